// Groups of joints that are commanded together, as controllers of ros2_control command them: by a
// `std_msgs/msg/Float64MultiArray` with a number for each joint.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "tessera/joints.h"

namespace tessera::ros {

struct JointGroup {
  std::string topic;  // "/arm_controller/commands"
  DriveMode mode = DriveMode::kPosition;
  std::vector<std::string> joints;  // in the order of the numbers
};

inline constexpr std::size_t kJointGroupsMax = 1000;  // of a file
inline constexpr std::size_t kJointsOfAGroupMax = 1000;

// The forward command controllers of a parameter file of ros2_control: those of a controller_manager, and of
// their nodes `joints` and, where the type does not say it, `interface_name`. Controllers of other types are
// named in the log. INVALID_ARGUMENT naming the file, the line and the controller; NOT_FOUND for a file that
// cannot be read.
absl::StatusOr<std::vector<JointGroup>> read_controllers(const std::string& file);

}  // namespace tessera::ros
