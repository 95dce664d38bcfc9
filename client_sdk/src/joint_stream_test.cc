// Coordinates of joints follow from the bodies, wherever in the world and in whichever sectors these are.
#include "client_sdk/src/joint_stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace tessera {
namespace {

using testing::ElementsAre;

constexpr double kSize = 16;

// A hinge about z; its frame is 1 m along x from the parent, and 2 m against x from the child.
FoundJoint hinge() {
  FoundJoint joint;
  joint.id = JointId{7};
  joint.joint.properties.type = JointType::kRevolute;
  joint.joint.properties.parent = BodyId{1};
  joint.joint.properties.child = BodyId{2};
  const Eigen::Quaterniond along_z(Eigen::AngleAxisd(-std::numbers::pi / 2, Eigen::Vector3d::UnitY()));
  joint.joint.properties.in_parent = {{1, 0, 0}, along_z};
  joint.joint.properties.in_child = {{-2, 0, 0}, along_z};
  joint.child_centre = {0.5, 0, 0};
  return joint;
}

BodySample body(std::uint64_t id, const SectorIndex& sector, const Eigen::Vector3d& local, double turn) {
  BodySample sample;
  sample.id = BodyId{id};
  sample.pose = {{sector, local}, Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()))};
  return sample;
}

// The child is turned by 0.3 rad about the hinge and spins with 2 rad/s; a sector border lies between the
// two.
BodyFrame frame_at(const SectorIndex& sector) {
  const SectorIndex next{sector.i + 1, sector.j, sector.k};
  const Eigen::Vector3d arm(std::cos(0.3), std::sin(0.3), 0);
  BodyFrame frame;
  frame.tick = 5;
  frame.bodies = {body(1, sector, {6, 0, 0}, 0),
                  body(2, next, Eigen::Vector3d(7 - kSize, 0, 0) + 2 * arm, 0.3)};
  frame.bodies[1].angular_velocity = {0, 0, 2};
  frame.bodies[1].linear_velocity = Eigen::Vector3d(0, 0, 2).cross(2.5 * arm);  // of its centre
  return frame;
}

TEST(JointStates, FollowFromTheBodies) {
  for (const SectorIndex& sector : {SectorIndex{}, SectorIndex{std::int64_t{1} << 62, -5, 9}}) {
    const JointFrame frame = joints_in(frame_at(sector), {hinge()}, kSize);
    EXPECT_EQ(frame.tick, 5u);
    ASSERT_EQ(frame.joints.size(), 1u);
    EXPECT_EQ(frame.joints[0].id, JointId{7});
    const JointState& state = frame.joints[0].state;
    EXPECT_NEAR(state.position[0], 0.3, 1e-12);
    EXPECT_NEAR(state.velocity[0], 2, 1e-12);
    EXPECT_NEAR(state.gap, 0, 1e-12);
    EXPECT_NEAR(state.twist, 0, 1e-7);
  }
}

TEST(JointStates, OfASlideAreOfTheJointNotOfTheCentre) {
  FoundJoint slide = hinge();
  slide.joint.properties.type = JointType::kPrismatic;
  slide.joint.properties.in_parent.orientation.setIdentity();
  slide.joint.properties.in_child.orientation.setIdentity();
  BodyFrame frame = frame_at({});
  frame.bodies[1] = body(2, {1, 0, 0}, {9.5 - kSize, 0, 0}, 0);
  frame.bodies[1].linear_velocity = {3, 0, 0};
  const JointState state = joints_in(frame, {slide}, kSize).joints.at(0).state;
  EXPECT_DOUBLE_EQ(state.position[0], 0.5);
  EXPECT_DOUBLE_EQ(state.velocity[0], 3);
}

TEST(JointStates, OfTheWorldCountFromTheAnchor) {
  FoundJoint pin = hinge();
  pin.joint.properties.parent = {};
  pin.joint.properties.anchor = {std::int64_t{1} << 62, 0, 0};
  pin.joint.properties.in_parent.position = {7, 0, 0};
  BodyFrame frame = frame_at({std::int64_t{1} << 62, 0, 0});
  frame.bodies.erase(frame.bodies.begin());
  const JointState state = joints_in(frame, {pin}, kSize).joints.at(0).state;
  EXPECT_NEAR(state.position[0], 0.3, 1e-12);
  EXPECT_NEAR(state.gap, 0, 1e-12);
}

TEST(JointStates, NeedBothBodies) {
  BodyFrame frame = frame_at({});
  frame.bodies.pop_back();
  EXPECT_TRUE(joints_in(frame, {hinge()}, kSize).joints.empty());
  frame = frame_at({});
  frame.bodies.erase(frame.bodies.begin());
  EXPECT_TRUE(joints_in(frame, {hinge()}, kSize).joints.empty());
}

TEST(JointStates, AskForTheBodiesOfAllJoints) {
  FoundJoint pin = hinge();
  pin.joint.properties.parent = {};
  FoundJoint other = hinge();
  other.joint.properties.child = BodyId{9};
  EXPECT_THAT(bodies_of({other, pin, hinge()}), ElementsAre(BodyId{1}, BodyId{2}, BodyId{9}));
}

}  // namespace
}  // namespace tessera
