// The ground around the camera, for worlds whose ground has no end: what the cluster's own rays meet.
#pragma once

#include <absl/status/statusor.h>

#include <nlohmann/json.hpp>

#include "client_sdk/live/cluster_monitor.h"
#include "tessera/client.h"

namespace tessera::viewer {

inline constexpr int kGroundSide = 33;           // points along each side of the patch
inline constexpr double kGroundHalfMin = 1;      // m
inline constexpr double kGroundHalfMax = 5'000;  // m, of the patch

// {position, "half": half its edge in m, "body": the id of the ground}: the points of a square patch, denser
// towards its middle, as {"side", "points": x, y and z of each in m from the centre of the position's sector,
// null where no ground is within kGroundDepth above and below}.
inline constexpr double kGroundDepth = 1'000;  // m
absl::StatusOr<nlohmann::json> ground(Client& client, const live::ClusterReport& report,
                                      const nlohmann::json& request);

}  // namespace tessera::viewer
