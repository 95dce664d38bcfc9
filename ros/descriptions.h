// Robots as ROS describes them: their URDF, for whoever shows them.
#pragma once

#include <absl/status/status.h>

#include <filesystem>
#include <string>

#include "ros/node.h"

namespace tessera::ros {

inline constexpr std::size_t kDescriptionBytesMax = 16U << 20;

// Publishes the file as `robot_description`, for readers that come later, too: below the name of its <robot>,
// or without that where it is `root`. NOT_FOUND if there is no such file; INVALID_ARGUMENT for one that is no
// URDF, or has more than kDescriptionBytesMax bytes.
absl::Status publish_description(Node& node, const std::filesystem::path& file, const std::string& root);

}  // namespace tessera::ros
