// Boxes of links that notice what is in them, for what looks at a part of space.
#pragma once

#include <absl/status/status.h>

#include <Eigen/Core>

#include "lpss/base/pose.h"
#include "worlds/loader/xml.h"

namespace tessera::gazebo {

// m. A link that can move is within a sector, its triggers included.
inline constexpr double kTriggerAcrossMax = 100;

// Adds a collision that is a trigger, at `pose` in the link. INVALID_ARGUMENT where the box is too large, or
// a side is not above 0.
absl::Status add_trigger(xml::Element& link, const char* name, const Pose& pose,
                         const Eigen::Vector3d& sides);

}  // namespace tessera::gazebo
