// Requests of the web UI about whole worlds: which there are, loading, resetting, saving and restoring.
#pragma once

#include <absl/status/statusor.h>

#include <nlohmann/json.hpp>

#include "client_sdk/live/cluster_monitor.h"
#include "tessera/client.h"
#include "viewer/page_options.h"

namespace tessera::viewer {

// {"worlds": [{"name", "text"}], "snapshots": [{"name", "bytes"}], "keeps_snapshots"}
nlohmann::json worlds(const PageOptions& options);

// {"world": a name of worlds(), "replace"}: loads it, and shows its bodies by its visuals.
absl::StatusOr<nlohmann::json> load(Client& client, const PageOptions& options,
                                    const nlohmann::json& request);

// Loads the world of the cluster anew from its file: that of its looks, or that of its name on the shelf.
// NOT_FOUND if there is none; FAILED_PRECONDITION if the world was loaded with other settings than its file
// has.
absl::StatusOr<nlohmann::json> reset(Client& client, const live::ClusterReport& report,
                                     const PageOptions& options);

// {"name"}: a new snapshot of the world.
absl::StatusOr<nlohmann::json> save(Client& client, const PageOptions& options,
                                    const nlohmann::json& request);

// {"name"}: records the world, until stop_recording(), or until there is no more room.
absl::StatusOr<nlohmann::json> record(const PageOptions& options, const nlohmann::json& request);
absl::StatusOr<nlohmann::json> stop_recording(const PageOptions& options);
nlohmann::json to_json(const RecorderState& state);

// {"name", "replace"}: the world of a snapshot.
absl::StatusOr<nlohmann::json> restore(Client& client, const PageOptions& options,
                                       const nlohmann::json& request);

}  // namespace tessera::viewer
