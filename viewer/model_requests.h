// Requests of the web UI about models: their bodies, joints and programs, and how joints are driven.
#pragma once

#include <absl/status/statusor.h>

#include <nlohmann/json.hpp>

#include "tessera/client.h"

namespace tessera::viewer {

// {"text"}: the first bodies whose names begin with it, as {"names": [{"id", "name"}], "truncated"}.
absl::StatusOr<nlohmann::json> names(Client& client, const nlohmann::json& request);

// {"text"}: likewise the first bodies whose names have it anywhere, in large or small letters, of the first
// 20,000 bodies of the world.
absl::StatusOr<nlohmann::json> search(Client& client, const nlohmann::json& request);

// {"model"}: its bodies, and its joints with their axes: where they are (rad or m), their limits (null:
// none), and where their drives lead them (null: they do not).
absl::StatusOr<nlohmann::json> model(Client& client, const nlohmann::json& request);

// {"joint": its name, "axis": from 0 on, "target": rad or m}: by the controller of that joint, if a program
// is one, or else by its drive. With {"free": true} in the place of a target, the drive lets go.
absl::StatusOr<nlohmann::json> drive(Client& client, const nlohmann::json& request);

// {"body": its id}: its programs with their inputs and values, and of those that look by rays, where these
// end.
absl::StatusOr<nlohmann::json> programs(Client& client, const nlohmann::json& request);

}  // namespace tessera::viewer
