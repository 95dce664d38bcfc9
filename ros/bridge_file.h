// Bridge files: which topics of a simulation ROS has, under which names, in the form of ros_gz_bridge.
#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <string>
#include <vector>

namespace tessera::ros {

// The way of messages.
enum class Flow { kToRos, kFromRos };

struct BridgeEntry {
  std::string where;      // "FILE, line 3"
  std::string ros_topic;  // "/scan"
  std::string gz_topic;   // as Gazebo would have it, without its world: "/model/robot/scan"
  std::string type;       // "sensor_msgs/msg/LaserScan"
  bool is_to_ros = true;
  bool is_from_ros = true;
  std::int32_t publisher_queue = 10;
  std::int32_t subscriber_queue = 10;
};

inline constexpr std::size_t kBridgeEntriesMax = 1000;
inline constexpr std::int32_t kBridgeQueueMax = 10'000;

// The entries whose types Tessera can carry; others are named in the log. INVALID_ARGUMENT naming the file,
// the line and the field: for one that is missing, unknown or not what it must be, types that do not belong
// together, and a direction that a type does not have here. NOT_FOUND for a file that cannot be read.
absl::StatusOr<std::vector<BridgeEntry>> read_bridge(const std::string& file);

// "/model/robot/odometry" of "/world/shapes/model/robot/odometry": a topic of Gazebo without its world, and
// with a '/' before it.
std::string without_world(absl::string_view topic);

}  // namespace tessera::ros
