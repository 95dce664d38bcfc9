// Joints that ROS 2 commands as controllers of ros2_control do, and what it is told of them.
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "cli/child_process.h"
#include "tests/cluster_fixture.h"
#include "tests/ros_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;
using ::testing::HasSubstr;
using ::testing::SizeIs;

using JointState = sensor_msgs_msg_dds__JointState_;

class RosJointsTest : public RosTest {
 protected:
  void SetUp() override {
    RosTest::SetUp();
    folder_ = cli::make_temporary_folder().value();
    cluster_ = start_cluster(1);
    ASSERT_TRUE(cluster_.client);
    ASSERT_THAT(cluster_.client->load(read_world("house.sdf")).status(), IsOk());
    states_ = read(sensor_msgs_msg_dds__JointState__desc, "rt/arm/joint_states", DDS_RELIABILITY_RELIABLE,
                   DDS_DURABILITY_VOLATILE);
  }
  void TearDown() override {
    RosTest::TearDown();
    std::filesystem::remove_all(folder_);
  }

  void command(const char* topic, std::vector<double> numbers, const Process& ros) const {
    const dds_entity_t commands = write_to(std_msgs_msg_dds__Float64MultiArray__desc, topic);
    ASSERT_TRUE(await_reader(commands)) << ros.output();
    const auto count = static_cast<std::uint32_t>(numbers.size());
    std_msgs_msg_dds__Float64MultiArray_ message{};
    message.data = {count, count, numbers.data(), false};
    ASSERT_EQ(dds_write(commands, &message), 0);
  }

  // Whether the joints of the arm come to these positions, and stay.
  bool await_positions(const std::map<std::string, double>& wanted) const {
    return await<JointState>(states_, [&](const JointState& state) {
      std::size_t there = 0;
      for (std::uint32_t n = 0; n < state.name._length; ++n) {
        const auto joint = wanted.find(state.name._buffer[n]);
        if (joint != wanted.end() && std::abs(state.position._buffer[n] - joint->second) < 0.02 &&
            std::abs(state.velocity._buffer[n]) < 0.01)
          ++there;
      }
      return there == wanted.size();
    });
  }

  std::filesystem::path folder_;
  Cluster cluster_;
  dds_entity_t states_ = 0;
};

TEST_F(RosJointsTest, ControllersOfAFileCommandTheirJointsInTheirOrder) {
  const std::string file = (folder_ / "controllers.yaml").string();
  std::ofstream(file) << R"(
controller_manager:
  ros__parameters:
    pose:
      type: forward_command_controller/ForwardCommandController
pose:
  ros__parameters:
    joints: [elbow, shoulder]
    interface_name: position
)";
  Process ros("tessera-ros",
              {"--connect", cluster_.processes->address(), "--rate", "1000", "--controllers", file});
  ASSERT_NO_FATAL_FAILURE(command("rt/pose/commands", {0.5, -0.25}, ros));
  ASSERT_THAT(cluster_.client->resume().status(), IsOk());
  EXPECT_TRUE(await_positions({{"elbow", 0.5}, {"shoulder", -0.25}})) << ros.output();
  ASSERT_NO_FATAL_FAILURE(command("rt/pose/commands", {0.5, -0.25, 1}, ros));
  EXPECT_TRUE(ros.await_output("/pose/commands: 3 numbers, but 2 joints")) << ros.output();
}

TEST_F(RosJointsTest, WithoutAFileEachModelHasControllersOfAllItsJoints) {
  const Process ros("tessera-ros", {"--connect", cluster_.processes->address(), "--rate", "1000"});
  ASSERT_NO_FATAL_FAILURE(command("rt/arm/position_controller/commands", {-0.25, std::nan("")}, ros));
  ASSERT_THAT(cluster_.client->resume().status(), IsOk());
  EXPECT_TRUE(await_positions({{"shoulder", -0.25}, {"elbow", 0.9}})) << ros.output();
}

TEST_F(RosJointsTest, EffortsAreThoseOfTheJoints) {
  const Process ros("tessera-ros", {"--connect", cluster_.processes->address(), "--rate", "1000"});
  ASSERT_THAT(cluster_.client->step(300, kPatience).status(), IsOk());
  QueryList queries;
  const auto place = queries.joint_states({.prefix = "arm::", .efforts = true});
  std::map<std::string, double> efforts;
  const std::vector<JointValues> values = cluster_.client->ask(queries, kPatience).value()[place];
  const FoundJoints joints = cluster_.client->find_joints("arm::", 10, kPatience).value();
  for (const FoundJoint& joint : joints.joints) {
    for (const JointValues& value : values) {
      if (value.id == joint.id) efforts[joint.joint.name] = value.efforts.at(0);
    }
  }
  ASSERT_THAT(efforts, SizeIs(2));
  EXPECT_GT(std::abs(efforts.at("arm::shoulder")), 1) << "it bears the arm";
  // Until the answer has come, there are none; of a world that stands still, all is told again and again.
  EXPECT_TRUE(await<JointState>(states_, [&](const JointState& state) {
    if (state.effort._length == 0 || state.header.stamp.sec < 5) return false;
    EXPECT_EQ(state.effort._length, state.name._length);
    bool is_same = true;
    for (std::uint32_t n = 0; n < state.effort._length; ++n)
      is_same &= state.effort._buffer[n] == efforts.at(std::string("arm::") + state.name._buffer[n]);
    return is_same;
  })) << ros.output();
}

TEST_F(RosJointsTest, AFileWithAFaultIsRefused) {
  const std::string file = (folder_ / "controllers.yaml").string();
  std::ofstream(file) << "controller_manager: {ros__parameters: {}}\n"
                         "arm: [";
  Process ros("tessera-ros", {"--connect", cluster_.processes->address(), "--controllers", file});
  EXPECT_NE(ros.wait(), 0);
  EXPECT_THAT(ros.output(), HasSubstr("not YAML"));
}

}  // namespace
}  // namespace tessera
