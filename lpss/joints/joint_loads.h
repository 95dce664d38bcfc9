// What a joint gave and bore in a tick.
#pragma once

#include <array>

namespace tessera {

// Means over the tick. 0 for a joint that no solver has looked at yet, and of an assembly that diverged.
struct JointLoads {
  // By axis, N m or N: of drive, spring, damper, friction and limit together; positive where they push to
  // larger positions.
  std::array<double, 2> effort{};
  // With which the joint acts on its child, efforts included: along the axes of the joint frame on the child,
  // the torque about its origin. The parent bears the opposite.
  std::array<double, 3> force{};   // N
  std::array<double, 3> torque{};  // N m

  friend bool operator==(const JointLoads&, const JointLoads&) = default;
};

}  // namespace tessera
