// What a page asks of the cluster, one request at a time: {"do": "pause" | "resume" | "step" | "spawn" |
// "push" | "remove" | "pick" | "find" | "places", ...}.
#pragma once

#include <nlohmann/json.hpp>

#include "client_sdk/live/cluster_monitor.h"
#include "tessera/client.h"

namespace tessera::viewer {

// The answer: what was asked for, or {"error": why}. With `read_only`, what would change the world is
// refused.
nlohmann::json answer(Client& client, const live::ClusterReport& report, bool read_only,
                      const nlohmann::json& request);

}  // namespace tessera::viewer
