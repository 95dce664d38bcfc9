// The status of a cluster as JSON, for `tessera status --json` and the web UI.
#pragma once

#include <nlohmann/json.hpp>

#include "tessera/client.h"

namespace tessera {

// The fields have the names of ClusterStatus and ServerStatus, except for `node`, a string of hexadecimal
// digits (JavaScript numbers hold 53 bits), `engine` ("f32" or "f64"), and `tick_ms` with `mean`,
// `p50`, `p99` and `max`. Counters (kTickCounters) have their own names, which `counters` lists: values as of
// the last tick, totals (`diverged`) since the load. `settings` is missing without a world.
nlohmann::json to_json(const NamedDivergence& divergence);
nlohmann::json to_json(const ClusterStatus& status);

nlohmann::json to_json(const TickTimes& times);

}  // namespace tessera
