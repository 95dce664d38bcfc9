// Controllers of ros2_control, read from their parameter files.
#include "ros/joint_groups.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace tessera::ros {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

absl::StatusOr<std::vector<JointGroup>> read_text(const std::string& text) {
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / ("controllers_" + std::to_string(getpid()) + ".yaml");
  std::ofstream(file) << text;
  absl::StatusOr<std::vector<JointGroup>> groups = read_controllers(file.string());
  std::filesystem::remove(file);
  return groups;
}

std::string fault_of(const std::string& text) { return std::string(read_text(text).status().message()); }

TEST(Controllers, ForwardCommandControllersHaveTheirJointsInOrder) {
  const std::vector<JointGroup> groups = read_text(R"(
controller_manager:
  ros__parameters:
    update_rate: 100
    joint_state_broadcaster:
      type: joint_state_broadcaster/JointStateBroadcaster
    arm:
      type: forward_command_controller/ForwardCommandController
    wheels:
      type: velocity_controllers/JointGroupVelocityController
arm:
  ros__parameters:
    joints: [shoulder, elbow]
    interface_name: effort
/**/wheels:
  ros__parameters:
    joints:
      - right
      - left
)")
                                             .value();
  ASSERT_EQ(groups.size(), 2u);
  EXPECT_EQ(groups[0].topic, "/arm/commands");
  EXPECT_EQ(groups[0].mode, DriveMode::kEffort);
  EXPECT_THAT(groups[0].joints, ElementsAre("shoulder", "elbow"));
  EXPECT_EQ(groups[1].topic, "/wheels/commands");
  EXPECT_EQ(groups[1].mode, DriveMode::kVelocity);
  EXPECT_THAT(groups[1].joints, ElementsAre("right", "left"));
}

TEST(Controllers, NamespacesAreThoseOfTheirManager) {
  const std::string node = "{ros__parameters: {joints: [a]}}";
  const std::string manager =
      "{ros__parameters: {go: {type: position_controllers/JointGroupPositionController}}}";
  EXPECT_EQ(read_text("/left/controller_manager: " + manager + "\n/left/go: " + node).value().at(0).topic,
            "/left/go/commands");
  EXPECT_EQ(read_text("left:\n  controller_manager: " + manager + "\n  go: " + node).value().at(0).topic,
            "/left/go/commands");
}

TEST(Controllers, FaultsNameTheControllerAndTheLine) {
  const std::string manager =
      "controller_manager:\n  ros__parameters:\n    arm: {type: "
      "forward_command_controller/ForwardCommandController}\n";
  EXPECT_THAT(fault_of("arm: {ros__parameters: {}}"), HasSubstr("there must be a controller_manager"));
  EXPECT_THAT(fault_of(manager), HasSubstr("line 3: controller /arm: it must have ros__parameters"));
  EXPECT_THAT(fault_of(manager + "arm: {ros__parameters: 3}"), HasSubstr("must be a map"));
  EXPECT_THAT(fault_of(manager + "arm: {ros__parameters: {joints: [a], interface_name: torque}}"),
              HasSubstr("line 4: controller /arm: interface_name must be position, velocity or effort"));
  EXPECT_THAT(fault_of(manager + "arm: {ros__parameters: {joints: a, interface_name: effort}}"),
              HasSubstr("joints must be a list of 1 to 1000 names"));
  EXPECT_THAT(fault_of(manager + "arm: {ros__parameters: {joints: [a, a], interface_name: effort}}"),
              HasSubstr("the joint a must be there once"));
  EXPECT_THAT(fault_of("a: [1, 2"), HasSubstr("not YAML"));
  EXPECT_EQ(read_controllers("/nowhere.yaml").status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace tessera::ros
