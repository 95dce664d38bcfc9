// Names of bodies and joints as ROS has them.
#pragma once

#include <absl/strings/string_view.h>

#include <string>

namespace tessera::ros {

// "arm/hand" of "robot::arm::hand".
std::string rest_of(const std::string& name);
// A name as a part of a topic: ROS has letters, digits and _ there, and no digit at first.
std::string topic_word(absl::string_view name);

}  // namespace tessera::ros
