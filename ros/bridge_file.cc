#include "ros/bridge_file.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/strip.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <utility>

#include "daemon/log.h"
#include "ros/yaml_file.h"

namespace tessera::ros {
namespace {

// A type of ROS that topics of Tessera have, and what Gazebo has for it.
struct BridgedType {
  absl::string_view ros;
  std::array<absl::string_view, 2> gazebo;  // without "gz.msgs."
  bool is_to_ros = true;
  bool is_from_ros = false;
};
constexpr std::array kTypes = {
    BridgedType{"geometry_msgs/msg/Twist", {"Twist"}, false, true},
    BridgedType{"geometry_msgs/msg/WrenchStamped", {"Wrench"}},
    BridgedType{"nav_msgs/msg/Odometry", {"Odometry", "OdometryWithCovariance"}},
    BridgedType{"rosgraph_msgs/msg/Clock", {"Clock"}},
    BridgedType{"sensor_msgs/msg/CameraInfo", {"CameraInfo"}},
    BridgedType{"sensor_msgs/msg/FluidPressure", {"FluidPressure"}},
    BridgedType{"sensor_msgs/msg/Image", {"Image"}},
    BridgedType{"sensor_msgs/msg/Imu", {"IMU"}},
    BridgedType{"sensor_msgs/msg/JointState", {"Model"}, true, true},
    BridgedType{"sensor_msgs/msg/LaserScan", {"LaserScan"}},
    BridgedType{"sensor_msgs/msg/MagneticField", {"Magnetometer"}},
    BridgedType{"sensor_msgs/msg/NavSatFix", {"NavSat"}},
    BridgedType{"sensor_msgs/msg/PointCloud2", {"PointCloudPacked"}},
    BridgedType{"std_msgs/msg/Float64", {"Double"}, false, true},
    BridgedType{"tf2_msgs/msg/TFMessage", {"Pose_V"}},
    BridgedType{"trajectory_msgs/msg/JointTrajectory", {"JointTrajectory"}, false, true},
};

constexpr std::array<absl::string_view, 10> kFields = {
    "topic_name", "ros_topic_name",  "gz_topic_name",    "ros_type_name", "gz_type_name",
    "direction",  "publisher_queue", "subscriber_queue", "lazy",          "publish_optical_frame"};

// Fields as releases before Gazebo Garden spell them.
std::string present_spelling(absl::string_view field) {
  return absl::ConsumePrefix(&field, "ign_") ? absl::StrCat("gz_", field) : std::string(field);
}

class EntryReader {
 public:
  EntryReader(const std::string& file, const YAML::Node& node) : file_(file), node_(node) {}

  // Nothing for one of a type that no topic of Tessera has.
  absl::StatusOr<std::optional<BridgeEntry>> read() {
    if (!node_.IsMap()) return fault_at(file_, node_, "an entry of a bridge must be a map");
    for (const auto& field : node_) {
      const std::optional<std::string> name = text_of(field.first);
      if (!name || std::ranges::find(kFields, present_spelling(*name)) == kFields.end())
        return fault(field.first, "unknown field", name ? absl::StrCat(" '", *name, "'") : "",
                     "; there are: ", absl::StrJoin(kFields, ", "));
    }
    BridgeEntry entry;
    entry.where = absl::StrCat(file_, ", line ", node_.Mark().line + 1);
    if (absl::Status status = read_topics(entry); !status.ok()) return status;
    for (const auto& [name, queue] : {std::pair{"publisher_queue", &entry.publisher_queue},
                                      std::pair{"subscriber_queue", &entry.subscriber_queue}}) {
      if (absl::Status status = read_queue(name, *queue); !status.ok()) return status;
    }
    for (const char* const name : {"lazy", "publish_optical_frame"}) {
      const YAML::Node field = node_[name];
      bool value = false;
      if (field.IsDefined() && !absl::SimpleAtob(text_of(field).value_or(""), &value))
        return fault(field, name, " must be true or false");
    }
    return read_types(std::move(entry));
  }

 private:
  template <typename... Parts>
  absl::Status fault(const YAML::Node& at, const Parts&... parts) const {
    return fault_at(file_, at, "entry of a bridge: ", parts...);
  }

  // In either spelling.
  YAML::Node field_of(const char* name) const {
    const YAML::Node field = node_[name];
    if (field.IsDefined() || !absl::StartsWith(name, "gz_")) return field;
    return node_[absl::StrCat("ign_", absl::StripPrefix(name, "gz_"))];
  }

  // A text; empty where there is none.
  absl::StatusOr<std::string> text(const char* name) const {
    const YAML::Node field = field_of(name);
    if (!field.IsDefined()) return "";
    const std::optional<std::string> given = text_of(field);
    if (!given || given->empty()) return fault(field, name, " must be a text");
    return *given;
  }

  absl::Status read_topics(BridgeEntry& entry) const {
    const absl::StatusOr<std::string> both = text("topic_name");
    const absl::StatusOr<std::string> ros = text("ros_topic_name");
    const absl::StatusOr<std::string> gazebo = text("gz_topic_name");
    for (const auto* given : {&both, &ros, &gazebo}) {
      if (!given->ok()) return given->status();
    }
    if (!both->empty() && !(ros->empty() && gazebo->empty()))
      return fault(node_["topic_name"], "topic_name excludes ros_topic_name and gz_topic_name");
    const std::string& any = !both->empty() ? *both : !ros->empty() ? *ros : *gazebo;
    if (any.empty()) return fault(node_, "topic_name, or ros_topic_name and gz_topic_name, must be given");
    const std::string& named = ros->empty() ? any : *ros;
    entry.ros_topic = absl::StartsWith(named, "/") ? named : absl::StrCat("/", named);
    entry.gz_topic = without_world(gazebo->empty() ? any : *gazebo);
    const bool is_topic = entry.ros_topic.size() > 1 && std::ranges::all_of(entry.ros_topic, [](char c) {
                            return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '/';
                          });
    if (!is_topic)
      return fault(node_, "the topic '", named, "' of ROS must have letters, digits, '_' and '/'");
    return absl::OkStatus();
  }

  absl::Status read_queue(const char* name, std::int32_t& queue) const {
    const YAML::Node field = node_[name];
    if (!field.IsDefined()) return absl::OkStatus();
    if (!absl::SimpleAtoi(text_of(field).value_or(""), &queue) || queue < 1 || queue > kBridgeQueueMax)
      return fault(field, name, " must be a whole number from 1 to ", kBridgeQueueMax);
    return absl::OkStatus();
  }

  absl::StatusOr<std::optional<BridgeEntry>> read_types(BridgeEntry entry) const {
    const absl::StatusOr<std::string> ros = text("ros_type_name");
    const absl::StatusOr<std::string> gazebo = text("gz_type_name");
    for (const auto& [name, given] : {std::pair{"ros_type_name", &ros}, std::pair{"gz_type_name", &gazebo}}) {
      if (!given->ok()) return given->status();
      if ((*given)->empty()) return fault(node_, name, " must be given");
    }
    absl::string_view message = *gazebo;
    if (!absl::ConsumePrefix(&message, "gz.msgs.") && !absl::ConsumePrefix(&message, "ignition.msgs."))
      return fault(field_of("gz_type_name"), "gz_type_name must begin with gz.msgs.");
    if (absl::Status status = read_direction(entry); !status.ok()) return status;
    const auto type = std::ranges::find(kTypes, absl::string_view(*ros), &BridgedType::ros);
    if (type == kTypes.end()) {
      log_warning(absl::StrCat(entry.where, ": no topic has the type ", *ros, ": ", entry.ros_topic,
                               " is not bridged"));
      return std::nullopt;
    }
    if (std::ranges::find(type->gazebo, message) == type->gazebo.end())
      return fault(node_, "gz_type_name must be gz.msgs.", type->gazebo.front(), " for ", *ros, ", not ",
                   *gazebo);
    entry.is_to_ros &= type->is_to_ros;
    entry.is_from_ros &= type->is_from_ros;
    if (!entry.is_to_ros && !entry.is_from_ros)
      return fault(node_["direction"], "direction must be ", type->is_to_ros ? "GZ_TO_ROS" : "ROS_TO_GZ",
                   " for ", *ros);
    entry.type = *ros;
    return entry;
  }

  absl::Status read_direction(BridgeEntry& entry) const {
    const absl::StatusOr<std::string> direction = text("direction");
    if (!direction.ok()) return direction.status();
    entry.is_from_ros = *direction != "GZ_TO_ROS" && *direction != "IGN_TO_ROS";
    entry.is_to_ros = *direction != "ROS_TO_GZ" && *direction != "ROS_TO_IGN";
    if (!direction->empty() && *direction != "BIDIRECTIONAL" && entry.is_from_ros && entry.is_to_ros)
      return fault(node_["direction"], "direction must be GZ_TO_ROS, ROS_TO_GZ or BIDIRECTIONAL, not ",
                   *direction);
    return absl::OkStatus();
  }

  const std::string& file_;
  const YAML::Node& node_;
};

}  // namespace

std::string without_world(absl::string_view topic) {
  absl::ConsumePrefix(&topic, "/");
  absl::string_view rest = topic;
  if (absl::ConsumePrefix(&rest, "world/")) {
    if (const std::size_t slash = rest.find('/'); slash != absl::string_view::npos)
      topic = rest.substr(slash + 1);
  }
  return absl::StrCat("/", topic);
}

absl::StatusOr<std::vector<BridgeEntry>> read_bridge(const std::string& file) {
  const absl::StatusOr<YAML::Node> root = read_yaml(file);
  if (!root.ok()) return root.status();
  if (!root->IsSequence() || root->size() > kBridgeEntriesMax)
    return fault_at(file, *root, "a bridge must be a list of at most ", kBridgeEntriesMax, " entries");
  std::vector<BridgeEntry> entries;
  for (const YAML::Node& node : *root) {
    absl::StatusOr<std::optional<BridgeEntry>> entry = EntryReader(file, node).read();
    if (!entry.ok()) return entry.status();
    if (*entry) entries.push_back(**std::move(entry));
  }
  return entries;
}

}  // namespace tessera::ros
