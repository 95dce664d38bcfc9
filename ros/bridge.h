// What a bridge file makes of topics: which of them ROS has, and under which names.
#pragma once

#include <absl/strings/string_view.h>

#include <set>
#include <string>
#include <vector>

#include "ros/bridge_file.h"

namespace tessera::ros {

// A topic as Tessera has it.
struct OwnTopic {
  std::string topic;  // "/robot/scan"
  std::string type;   // "sensor_msgs/msg/LaserScan"
  Flow flow = Flow::kToRos;
  std::string model;   // "robot"; empty: the world's
  std::string sensor;  // as topics have its name; empty: of no sensor
  // What Gazebo calls it: after its model ("/model/robot/odometry"), or at the end of a topic that the world
  // file chooses.
  std::vector<std::string> names;
  // Whether a topic of its type in Gazebo can only be this one, unless it names another model.
  bool is_only_one = false;
};

// "sensor_msgs/msg/LaserScan" of "sensor_msgs::msg::dds_::LaserScan_".
std::string ros_type(absl::string_view dds_type);

// For one thread.
class Bridge {
 public:
  explicit Bridge(std::vector<BridgeEntry> entries) : entries_(std::move(entries)) {}

  // Null: ROS does not have it. An entry with the topic's own name comes first; then one with the name that
  // Gazebo gives it; then one that ends as it does, or can only be this one. An entry whose topic has the
  // name of another one of the `models` does not count.
  const BridgeEntry* find(const OwnTopic& topic, const std::set<std::string>& models);

  // Whether ROS has a topic of this name.
  bool has_ros_topic(absl::string_view topic) const;

  // Of entries that no topic has been found for since the last call: "FILE, line 3: ...", each said once.
  std::vector<std::string> take_unused();

 private:
  std::vector<BridgeEntry> entries_;
  std::set<const BridgeEntry*> used_;
  std::set<const BridgeEntry*> told_;
};

}  // namespace tessera::ros
