// The status of a cluster as JSON: what `tessera status --json` writes and what the viewer's page reads.
#pragma once

#include <nlohmann/json.hpp>

#include "tessera/client.h"

namespace tessera {

// The fields are those of ClusterStatus and ServerStatus by their names, but for: `node`, which is a string
// of hexadecimal digits (a number of JavaScript holds 53 bits), `engine` ("f32" or "f64"), and `tick_ms` with
// `p50`, `p99` and `max`. Counters (kTickCounters) stand under their names, which `counters` lists: what
// there is as of the last tick, what happens (`bodies_stopped`) since the load. `settings` is not there
// without a world.
nlohmann::json to_json(const ClusterStatus& status);

}  // namespace tessera
