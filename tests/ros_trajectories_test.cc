// The action FollowJointTrajectory, called as a ROS 2 node over Cyclone DDS calls it.
#include <gmock/gmock.h>

#include <array>
#include <cstring>
#include <string>
#include <vector>

#include "ros/follower.h"
#include "tests/cluster_fixture.h"
#include "tests/ros_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;

constexpr char kAction[] = "/arm/joint_trajectory_controller/follow_joint_trajectory/_action/";
constexpr std::int8_t kSucceededGoal = 4;
constexpr std::int8_t kCanceledGoal = 5;
constexpr std::int8_t kAbortedGoal = 6;

using Feedback = control_msgs_action_dds__FollowJointTrajectory_FeedbackMessage_;
using Result = control_msgs_action_dds__FollowJointTrajectory_GetResult_Response_;

class RosTrajectoriesTest : public RosTest {
 protected:
  void SetUp() override {
    RosTest::SetUp();
    cluster_ = start_cluster(1);
    ASSERT_TRUE(cluster_.client);
    ASSERT_THAT(cluster_.client->load(read_world("rover.sdf")).status(), IsOk());
  }

  // A goal with the number `id`: the joint is at `position` after `seconds`. Whether it is accepted.
  bool send(std::uint8_t id, const char* joint, double position, std::int32_t seconds, double tolerance) {
    std::array<char*, 1> names = {const_cast<char*>(joint)};
    std::array<double, 1> positions = {position};
    trajectory_msgs_msg_dds__JointTrajectoryPoint_ point{};
    point.positions = {1, 1, positions.data(), false};
    point.time_from_start.sec = seconds;
    control_msgs_msg_dds__JointTolerance_ near{const_cast<char*>(joint), tolerance, 0, 0};
    control_msgs_action_dds__FollowJointTrajectory_SendGoal_Request_ request{};
    request.goal_id.uuid[0] = id;
    request.goal.trajectory.header.frame_id = const_cast<char*>("");
    request.goal.trajectory.joint_names = {1, 1, names.data(), false};
    request.goal.trajectory.points = {1, 1, &point, false};
    request.goal.multi_dof_trajectory.header.frame_id = const_cast<char*>("");
    request.goal.goal_tolerance = {1, 1, &near, false};
    request.goal.goal_time_tolerance.sec = 2;
    bool accepted = false;
    call<control_msgs_action_dds__FollowJointTrajectory_SendGoal_Response_>(
        std::string(kAction) + "send_goal",
        control_msgs_action_dds__FollowJointTrajectory_SendGoal_Request__desc,
        control_msgs_action_dds__FollowJointTrajectory_SendGoal_Response__desc, request,
        [&](const control_msgs_action_dds__FollowJointTrajectory_SendGoal_Response_& reply) {
          accepted = reply.accepted;
        });
    return accepted;
  }

  // Once it has ended.
  std::int8_t status_of(std::uint8_t id) {
    control_msgs_action_dds__FollowJointTrajectory_GetResult_Request_ request{};
    request.goal_id.uuid[0] = id;
    std::int8_t status = -1;
    call<Result>(std::string(kAction) + "get_result",
                 control_msgs_action_dds__FollowJointTrajectory_GetResult_Request__desc,
                 control_msgs_action_dds__FollowJointTrajectory_GetResult_Response__desc, request,
                 [&](const Result& reply) {
                   status = reply.status;
                   error_ = reply.result.error_code;
                   why_ = reply.result.error_string;
                 });
    return status;
  }

  double position_of(const std::string& joint) {
    QueryList queries;
    const auto states = queries.joint_states({.prefix = joint});
    return (*cluster_.client->ask(queries, kPatience))[states].at(0).positions.at(0);
  }

  Cluster cluster_;
  std::int32_t error_ = 0;
  std::string why_;
};

TEST_F(RosTrajectoriesTest, AGoalIsReachedOrItIsSaidWhyNot) {
  const Process ros("tessera-ros", {"--connect", cluster_.processes->address(), "--rate", "1000"});
  EXPECT_FALSE(send(1, "wing", 0.4, 1, 0.05)) << "it has none";
  ASSERT_THAT(cluster_.client->resume().status(), IsOk());
  const dds_entity_t feedback = read(control_msgs_action_dds__FollowJointTrajectory_FeedbackMessage__desc,
                                     (std::string("rt") + kAction + "feedback").c_str(),
                                     DDS_RELIABILITY_RELIABLE, DDS_DURABILITY_VOLATILE);
  ASSERT_TRUE(await_writer(feedback)) << ros.output();
  ASSERT_TRUE(send(2, "elbow", 0.4, 1, 0.05)) << ros.output();
  EXPECT_TRUE(await<Feedback>(feedback, [](const Feedback& message) {
    const auto& [header, joints, desired, actual, error, others, no, nor, none] = message.feedback;
    EXPECT_EQ(message.goal_id.uuid[0], 2);
    EXPECT_EQ(joints._length, 1u);
    if (joints._length != 1 || actual.positions._length != 1) return true;
    EXPECT_STREQ(joints._buffer[0], "elbow");
    EXPECT_DOUBLE_EQ(error.positions._buffer[0], desired.positions._buffer[0] - actual.positions._buffer[0]);
    return actual.positions._buffer[0] > 0.2;
  }));
  EXPECT_EQ(status_of(2), kSucceededGoal) << why_;
  EXPECT_EQ(error_, 0);
  EXPECT_NEAR(position_of("arm::elbow"), 0.4, 0.06);
  EXPECT_EQ(status_of(3), 0) << "nobody knows it";

  ASSERT_TRUE(send(4, "elbow", 0.1, 60, 0.05));
  ASSERT_TRUE(send(5, "elbow", 0.3, 1, 0.05));
  EXPECT_EQ(status_of(4), kAbortedGoal) << "another one has come";
  EXPECT_EQ(status_of(5), kSucceededGoal) << why_;

  ASSERT_TRUE(send(6, "elbow", 0.1, 60, 0.05));
  action_msgs_srv_dds__CancelGoal_Request_ all{};
  call<action_msgs_srv_dds__CancelGoal_Response_>(
      std::string(kAction) + "cancel_goal", action_msgs_srv_dds__CancelGoal_Request__desc,
      action_msgs_srv_dds__CancelGoal_Response__desc, all, [](const auto& reply) {
        ASSERT_EQ(reply.goals_canceling._length, 1u);
        EXPECT_EQ(reply.goals_canceling._buffer[0].goal_id.uuid[0], 6);
      });
  EXPECT_EQ(status_of(6), kCanceledGoal);
}

}  // namespace
}  // namespace tessera
