// Requests of the web UI to the cluster, one at a time: {"do": "pause" | "resume" | "step" | "spawn" |
// "push" | "remove" | "undo" | "drive" | "pick" | "find" | "names" | "search" | "model" | "places" | "ground"
// | "programs" | "worlds" | "load" | "reset" | "save" | "restore" | "record" | "stop_recording", ...}.
#pragma once

#include <absl/time/time.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "client_sdk/live/cluster_monitor.h"
#include "tessera/client.h"
#include "viewer/page_options.h"

namespace tessera::viewer {

inline constexpr absl::Duration kRequestTimeout = absl::Seconds(5);  // of the cluster

// What the requests of one tab are answered with.
struct RequestContext {
  Client& client;
  const live::ClusterReport& report;
  const PageOptions& options;
  std::optional<NewBody>& removed;  // the body that was removed last, if that can be undone
};

// The answer, or {"error": reason}. Requests that the options do not allow are refused.
nlohmann::json answer(const RequestContext& context, const nlohmann::json& request);

}  // namespace tessera::viewer
