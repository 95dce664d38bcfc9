// A bridge file, in the form that ros_gz_bridge has: which topics ROS has of a cluster, and under which
// names.
#include <absl/strings/match.h>
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include "cli/child_process.h"
#include "tests/cluster_fixture.h"
#include "tests/ros_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

using JointState = sensor_msgs_msg_dds__JointState_;
using Odometry = nav_msgs_msg_dds__Odometry_;
using Scan = sensor_msgs_msg_dds__LaserScan_;

class RosBridgeTest : public RosTest {
 protected:
  void SetUp() override {
    RosTest::SetUp();
    folder_ = cli::make_temporary_folder().value();
    file_ = (folder_ / "bridge.yaml").string();
    publications_ = dds_create_reader(participant_, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr);
    cluster_ = start_cluster(1);
    ASSERT_TRUE(cluster_.client);
    ASSERT_THAT(cluster_.client->load(read_world("house.sdf")).status(), IsOk());
  }
  void TearDown() override {
    RosTest::TearDown();
    std::filesystem::remove_all(folder_);
  }

  dds_entity_t read_topic(const dds_topic_descriptor_t& type, const char* topic) const {
    return read(type, topic, DDS_RELIABILITY_RELIABLE, DDS_DURABILITY_VOLATILE);
  }

  // Topics of ROS that somebody writes, but those of actions.
  std::set<std::string> published() const {
    std::set<std::string> topics;
    void* sample = nullptr;
    dds_sample_info_t info;
    while (dds_take(publications_, &sample, &info, 1, 1) == 1) {
      const std::string topic = static_cast<const dds_builtintopic_endpoint_t*>(sample)->topic_name;
      if (absl::StartsWith(topic, "rt/") && !absl::StrContains(topic, "/_action/")) topics.insert(topic);
      dds_return_loan(publications_, &sample, 1);
    }
    return topics;
  }

  std::filesystem::path folder_;
  std::string file_;
  dds_entity_t publications_ = 0;
  Cluster cluster_;
};

TEST_F(RosBridgeTest, RosHasTheTopicsOfTheFileAndNoOthers) {
  std::ofstream(file_) << R"(
- {topic_name: clock, ros_type_name: rosgraph_msgs/msg/Clock, gz_type_name: gz.msgs.Clock, direction: GZ_TO_ROS}
- ros_topic_name: laser
  gz_topic_name: /world/house/model/burger/link/base_link/sensor/scan/scan
  ros_type_name: sensor_msgs/msg/LaserScan
  gz_type_name: gz.msgs.LaserScan
- ros_topic_name: go
  gz_topic_name: /model/burger/cmd_vel
  ros_type_name: geometry_msgs/msg/Twist
  gz_type_name: gz.msgs.Twist
  direction: ROS_TO_GZ
- ros_topic_name: wheels
  gz_topic_name: /model/burger/odometry
  ros_type_name: nav_msgs/msg/Odometry
  gz_type_name: gz.msgs.Odometry
- ros_topic_name: bend
  gz_topic_name: /model/arm/joint/elbow/0/cmd_pos
  ros_type_name: std_msgs/msg/Float64
  gz_type_name: gz.msgs.Double
- ros_topic_name: arm_joints
  gz_topic_name: /world/house/model/arm/joint_state
  ros_type_name: sensor_msgs/msg/JointState
  gz_type_name: gz.msgs.Model
- {topic_name: sonar, ros_type_name: sensor_msgs/msg/LaserScan, gz_type_name: gz.msgs.LaserScan}
)";
  Process ros("tessera-ros",
              {"--connect", cluster_.processes->address(), "--rate", "1000", "--bridge", file_});
  const dds_entity_t scans = read_topic(sensor_msgs_msg_dds__LaserScan__desc, "rt/laser");
  const dds_entity_t wheels = read_topic(nav_msgs_msg_dds__Odometry__desc, "rt/wheels");
  const dds_entity_t joints = read_topic(sensor_msgs_msg_dds__JointState__desc, "rt/arm_joints");
  const dds_entity_t velocities = write_to(geometry_msgs_msg_dds__Twist__desc, "rt/go");
  const dds_entity_t elbow = write_to(std_msgs_msg_dds__Float64__desc, "rt/bend");
  ASSERT_TRUE(await_reader(velocities) && await_reader(elbow)) << ros.output();
  EXPECT_TRUE(ros.await_output("nothing in this world is /sonar")) << ros.output();

  const geometry_msgs_msg_dds__Twist_ ahead{.linear = {.x = 0.2}};
  ASSERT_EQ(dds_write(velocities, &ahead), 0);
  const std_msgs_msg_dds__Float64_ angle{0.5};
  ASSERT_EQ(dds_write(elbow, &angle), 0);
  ASSERT_THAT(cluster_.client->resume().status(), IsOk());
  EXPECT_TRUE(await<Scan>(scans, [](const Scan& scan) { return scan.ranges._length > 1; })) << ros.output();
  EXPECT_TRUE(await<Odometry>(wheels, [](const Odometry& odometry) {
    return std::abs(odometry.twist.twist.linear.x - 0.2) < 0.01 && odometry.pose.pose.position.x > 0.1;
  })) << ros.output();
  EXPECT_TRUE(await<JointState>(joints, [](const JointState& state) {
    for (std::uint32_t n = 0; n < state.name._length; ++n) {
      if (std::string(state.name._buffer[n]) == "elbow")
        return std::abs(state.position._buffer[n] - 0.5) < 0.02;
    }
    return false;
  })) << ros.output();
  EXPECT_THAT(published(),
              ElementsAre("rt/arm_joints", "rt/bend", "rt/clock", "rt/go", "rt/laser", "rt/wheels"));
}

TEST_F(RosBridgeTest, AFileWithAFaultIsRefused) {
  std::ofstream(file_) << "- {topic_name: scan, ros_type_name: sensor_msgs/msg/LaserScan, gz_type_name: "
                          "gz.msgs.IMU}\n";
  Process ros("tessera-ros", {"--connect", cluster_.processes->address(), "--bridge", file_});
  EXPECT_NE(ros.wait(), 0);
  EXPECT_THAT(ros.output(), HasSubstr("line 1: entry of a bridge: gz_type_name must be gz.msgs.LaserScan"));
}

}  // namespace
}  // namespace tessera
