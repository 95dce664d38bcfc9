// A robot set on a plane: whether it stands there, and whether its wheels take it along.
#pragma once

#include <absl/status/statusor.h>

#include <optional>

#include "lpss/model/world_description.h"

namespace tessera::models {

inline constexpr double kSunkMax = 2e-3;        // m below the plane, after kStandingTime
inline constexpr double kWheelWayError = 0.01;  // of radius times angle
inline constexpr double kStandingTime = 5;      // s

struct OnPlane {
  double lowest = 0;  // m, above the plane: the lowest point of all bodies after kStandingTime
  int wheels = 0;     // that are driven
  // The way that they cover, by their radius times the angle that they turn; nothing without such wheels.
  std::optional<double> wheel_way;
  bool diverged = false;
};

// Whether a world is a robot without a ground: joints, and nothing that is static or held by the world.
bool is_robot(const WorldDescription& world);

// Sets the robot down where its lowest point is now, with a friction of 1, and holds all of its joints by
// servos where they are, but for wheels and what casters turn on. Then it drives the wheels of its trunk,
// those that touch the plane at 0.3 m/s, all in one direction. Errors as PartitionCluster::create().
absl::StatusOr<OnPlane> set_on_plane(WorldDescription robot);

}  // namespace tessera::models
