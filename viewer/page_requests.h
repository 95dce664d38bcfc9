// Requests of the web UI to the cluster, one at a time: {"do": "pause" | "resume" | "step" | "spawn" |
// "push" | "remove" | "drive" | "pick" | "find" | "names" | "search" | "model" | "places" | "programs", ...}.
#pragma once

#include <absl/time/time.h>

#include <nlohmann/json.hpp>

#include "client_sdk/live/cluster_monitor.h"
#include "tessera/client.h"

namespace tessera::viewer {

inline constexpr absl::Duration kRequestTimeout = absl::Seconds(5);  // of the cluster

// The answer, or {"error": reason}. With `read_only`, requests that would change the world are refused.
nlohmann::json answer(Client& client, const live::ClusterReport& report, bool read_only,
                      const nlohmann::json& request);

}  // namespace tessera::viewer
