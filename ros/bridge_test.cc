// Bridge files, and the topics that they mean.
#include "ros/bridge.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace tessera::ros {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

absl::StatusOr<std::vector<BridgeEntry>> read_bridge_text(const std::string& text) {
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / ("bridge_" + std::to_string(getpid()) + ".yaml");
  std::ofstream(file) << text;
  absl::StatusOr<std::vector<BridgeEntry>> entries = read_bridge(file.string());
  std::filesystem::remove(file);
  return entries;
}

std::string entry_text(const std::string& gz_topic, const std::string& ros, const std::string& gazebo,
                       const std::string& more = "") {
  return "- {gz_topic_name: " + gz_topic + ", ros_type_name: " + ros + ", gz_type_name: " + gazebo + more +
         "}\n";
}
std::string scan_entry(const std::string& topic, const std::string& more = "") {
  return entry_text(topic, "sensor_msgs/msg/LaserScan", "gz.msgs.LaserScan", more);
}

TEST(BridgeFile, EntriesHaveTheFieldsOfGazebosBridge) {
  const std::vector<BridgeEntry> entries = read_bridge_text(R"(
- topic_name: clock
  ros_type_name: rosgraph_msgs/msg/Clock
  gz_type_name: gz.msgs.Clock
- ros_topic_name: /front/scan
  gz_topic_name: /world/house/model/burger/link/base/sensor/scan/scan
  ros_type_name: sensor_msgs/msg/LaserScan
  gz_type_name: gz.msgs.LaserScan
  direction: GZ_TO_ROS
  publisher_queue: 6
  subscriber_queue: 5
  lazy: true
- ign_topic_name: cmd_vel
  ros_type_name: geometry_msgs/msg/Twist
  ign_type_name: ignition.msgs.Twist
  direction: ROS_TO_IGN
- {topic_name: text, ros_type_name: std_msgs/msg/String, gz_type_name: gz.msgs.StringMsg}
)")
                                               .value();
  ASSERT_EQ(entries.size(), 3u) << "no topic of Tessera is a text";
  EXPECT_EQ(entries[0].ros_topic, "/clock");
  EXPECT_EQ(entries[0].gz_topic, "/clock");
  EXPECT_TRUE(entries[0].is_to_ros && !entries[0].is_from_ros) << "BIDIRECTIONAL is what there is";
  EXPECT_EQ(entries[1].ros_topic, "/front/scan");
  EXPECT_EQ(entries[1].gz_topic, "/model/burger/link/base/sensor/scan/scan");
  EXPECT_EQ(entries[1].type, "sensor_msgs/msg/LaserScan");
  EXPECT_EQ(entries[1].publisher_queue, 6);
  EXPECT_EQ(entries[1].subscriber_queue, 5);
  EXPECT_EQ(entries[2].ros_topic, "/cmd_vel");
  EXPECT_TRUE(entries[2].is_from_ros && !entries[2].is_to_ros);
}

TEST(BridgeFile, FaultsNameTheLineAndTheField) {
  for (const auto& [text, fault] : {
           std::pair<std::string, const char*>{"a: 1", "a bridge must be a list of at most 1000 entries"},
           {"- 3", "line 1: an entry of a bridge must be a map"},
           {scan_entry("/a") + scan_entry("/b", ", ros_topic: c"),
            "line 2: entry of a bridge: unknown field 'ros_topic'"},
           {scan_entry("/a", ", topic_name: b"), "topic_name excludes ros_topic_name and gz_topic_name"},
           {scan_entry("/a", ", ros_topic_name: 'a b'"), "the topic 'a b' of ROS must have letters"},
           {scan_entry("/a", ", direction: UP"),
            "direction must be GZ_TO_ROS, ROS_TO_GZ or BIDIRECTIONAL, not UP"},
           {scan_entry("/a", ", direction: ROS_TO_GZ"),
            "direction must be GZ_TO_ROS for sensor_msgs/msg/LaserScan"},
           {scan_entry("/a", ", publisher_queue: 0"),
            "publisher_queue must be a whole number from 1 to 10000"},
           {scan_entry("/a", ", subscriber_queue: many"), "subscriber_queue must be a whole number"},
           {scan_entry("/a", ", lazy: perhaps"), "lazy must be true or false"},
           {scan_entry("[a]"), "gz_topic_name must be a text"},
           {entry_text("/a", "sensor_msgs/msg/Imu", "gz.msgs.LaserScan"),
            "gz_type_name must be gz.msgs.IMU for sensor_msgs/msg/Imu, not gz.msgs.LaserScan"},
           {entry_text("/a", "sensor_msgs/msg/Imu", "IMU"), "gz_type_name must begin with gz.msgs."},
           {"- {topic_name: a, ros_type_name: b, ign_type_name: c}", "gz_type_name must begin with gz.msgs."},
           {"- {topic_name: a, gz_type_name: gz.msgs.IMU}", "ros_type_name must be given"},
           {"- {ros_type_name: a, gz_type_name: gz.msgs.IMU}", "topic_name, or ros_topic_name and"},
           {"- [", "not YAML"},
       })
    EXPECT_THAT(std::string(read_bridge_text(text).status().message()), HasSubstr(fault)) << text;
  EXPECT_EQ(read_bridge("/nowhere.yaml").status().code(), absl::StatusCode::kNotFound);
}

class BridgeTest : public ::testing::Test {
 protected:
  // The topic of an entry that means a scanner of the model, called "front".
  std::string of_scanner(const std::string& file, const std::string& model) {
    Bridge bridge(read_bridge_text(file).value());
    const BridgeEntry* const found = bridge.find({.topic = "/" + model + "/front",
                                                  .type = "sensor_msgs/msg/LaserScan",
                                                  .model = model,
                                                  .sensor = "front",
                                                  .names = {"front", "front/scan"}},
                                                 models_);
    return found == nullptr ? "" : found->gz_topic;
  }
  std::string of_velocity(const std::string& file, const std::string& model) {
    Bridge bridge(read_bridge_text(file).value());
    const BridgeEntry* const found = bridge.find({.topic = "/" + model + "/cmd_vel",
                                                  .type = "geometry_msgs/msg/Twist",
                                                  .flow = Flow::kFromRos,
                                                  .model = model,
                                                  .names = {"cmd_vel"},
                                                  .is_only_one = true},
                                                 models_);
    return found == nullptr ? "" : found->gz_topic;
  }
  static std::string twist_entry(const std::string& topic) {
    return entry_text(topic, "geometry_msgs/msg/Twist", "gz.msgs.Twist");
  }

  std::set<std::string> models_ = {"left", "right"};
};

TEST_F(BridgeTest, SensorsAreFoundByTheirNamesAndByThoseOfGazebo) {
  for (const char* topic : {"/left/front", "/model/left/link/hull/sensor/front/scan", "/front",
                            "/laser/front", "/laser/front/scan", "/any/left/front"})
    EXPECT_EQ(of_scanner(scan_entry(topic), "left"), topic);
  for (const char* topic : {"/right/front", "/model/right/link/hull/sensor/front/scan", "/back",
                            "/model/other/front", "/model/left/link/hull/sensor/back/scan", "/upfront"})
    EXPECT_EQ(of_scanner(scan_entry(topic), "left"), "") << topic;
  EXPECT_EQ(of_scanner(entry_text("/left/front", "sensor_msgs/msg/Imu", "gz.msgs.IMU"), "left"), "")
      << "of another type";
}

TEST_F(BridgeTest, TheSurestEntryCounts) {
  EXPECT_EQ(of_scanner(scan_entry("/front") + scan_entry("/model/left/link/a/sensor/front/scan"), "left"),
            "/model/left/link/a/sensor/front/scan");
  EXPECT_EQ(
      of_scanner(scan_entry("/model/left/link/a/sensor/front/scan") + scan_entry("/left/front"), "left"),
      "/left/front");
}

TEST_F(BridgeTest, VelocitiesAreThoseOfTheOnlyEntryThatNamesNoOtherModel) {
  EXPECT_EQ(of_velocity(twist_entry("/drive/commands"), "left"), "/drive/commands");
  EXPECT_EQ(of_velocity(twist_entry("/drive/commands"), "right"), "/drive/commands");
  EXPECT_EQ(of_velocity(twist_entry("/model/left/cmd_vel"), "right"), "");
  EXPECT_EQ(of_velocity(twist_entry("/left/cmd_vel") + twist_entry("/right/cmd_vel"), "right"),
            "/right/cmd_vel");
}

TEST_F(BridgeTest, EntriesThatNothingIsFoundForAreToldOnce) {
  Bridge bridge(read_bridge_text(scan_entry("/front") + scan_entry("/back")).value());
  const OwnTopic topic = {.topic = "/front", .type = "sensor_msgs/msg/LaserScan"};
  ASSERT_NE(bridge.find(topic, {}), nullptr);
  EXPECT_THAT(
      bridge.take_unused(),
      ElementsAre(HasSubstr("line 2: nothing in this world is /back of type sensor_msgs/msg/LaserScan: "
                            "/back is not bridged")));
  EXPECT_THAT(bridge.take_unused(), ElementsAre());
}

TEST(BridgeTypes, AreThoseOfRos) {
  EXPECT_EQ(ros_type("sensor_msgs::msg::dds_::LaserScan_"), "sensor_msgs/msg/LaserScan");
}

}  // namespace
}  // namespace tessera::ros
