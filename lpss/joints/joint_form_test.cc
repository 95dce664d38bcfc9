#include "lpss/joints/joint_form.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "lpss/base/rotation.h"

namespace tessera {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr JointType kTypes[] = {JointType::kFixed, JointType::kRevolute,  JointType::kPrismatic,
                                JointType::kBall,  JointType::kUniversal, JointType::kScrew};

class PlacedChild : public ::testing::TestWithParam<JointType> {
 protected:
  Vector3d vector(double largest) {
    std::uniform_real_distribution<double> number(-largest, largest);
    return Vector3d(number(random_), number(random_), number(random_));
  }
  Pose pose() { return {vector(2), rotation_by(vector(1.5))}; }

  JointForm joint() {
    JointForm joint;
    joint.type = GetParam();
    joint.in_parent = pose();
    joint.in_child = pose();
    joint.pitch = 0.3;
    return joint;
  }
  JointSide parent() { return {pose(), vector(3), vector(3)}; }
  JointPlace place() {
    const Vector3d q = vector(1.4);
    const Vector3d rates = vector(5);
    JointPlace place;
    for (int axis = 0; axis < axis_count(GetParam()); ++axis) {
      place.position[axis] = q[axis];
      place.velocity[axis] = rates[axis];
    }
    if (GetParam() == JointType::kBall) place.ball = rotation_by(vector(1.5));
    return place;
  }

  std::mt19937 random_{1};
};

TEST_P(PlacedChild, IsWhereTheJointIsAtItsCoordinates) {
  for (int n = 0; n < 20; ++n) {
    const JointForm joint = this->joint();
    const JointSide parent = this->parent();
    const JointPlace place = this->place();
    const JointSide child = placed_child(joint, parent, place);
    const JointState state = joint_state(joint, parent, child);
    for (int axis = 0; axis < 2; ++axis) {
      EXPECT_NEAR(state.position[axis], place.position[axis], 1e-9);
      EXPECT_NEAR(state.velocity[axis], place.velocity[axis], 1e-9);
    }
    EXPECT_NEAR(state.gap, 0, 1e-9);
    EXPECT_NEAR(state.twist, 0, 1e-7);
    EXPECT_NEAR(child.pose.orientation.norm(), 1, 1e-12);
    if (joint.type != JointType::kBall) continue;
    const Quaterniond turn =
        (parent.pose * joint.in_parent).orientation.conjugate() * (child.pose * joint.in_child).orientation;
    EXPECT_NEAR(turn.angularDistance(place.ball), 0, 1e-7);
    EXPECT_NEAR((child.angular_velocity - parent.angular_velocity).norm(), 0, 1e-12);
  }
}

// Parent and coordinates a moment later: the child has gone where its velocity takes it.
TEST_P(PlacedChild, MovesAsItsParentAndItsCoordinatesDo) {
  constexpr double kMoment = 1e-5;  // s
  const auto later = [&](const JointForm& joint, JointSide parent, JointPlace place, double time) {
    parent.pose.position += time * parent.linear_velocity;
    parent.pose.orientation = rotation_by(time * parent.angular_velocity) * parent.pose.orientation;
    for (int axis = 0; axis < 2; ++axis) place.position[axis] += time * place.velocity[axis];
    return placed_child(joint, parent, place).pose;
  };
  for (int n = 0; n < 20; ++n) {
    const JointForm joint = this->joint();
    const JointSide parent = this->parent();
    const JointPlace place = this->place();
    const JointSide child = placed_child(joint, parent, place);
    const Pose before = later(joint, parent, place, -kMoment);
    const Pose after = later(joint, parent, place, kMoment);
    const Vector3d linear = (after.position - before.position) / (2 * kMoment);
    const Quaterniond turn = after.orientation * before.orientation.conjugate();
    const Vector3d angular = turn.vec() * (turn.w() < 0 ? -2 : 2) / (2 * kMoment);
    EXPECT_NEAR((linear - child.linear_velocity).norm(), 0, 1e-5);
    EXPECT_NEAR((angular - child.angular_velocity).norm(), 0, 1e-5);
  }
}

INSTANTIATE_TEST_SUITE_P(Types, PlacedChild, ::testing::ValuesIn(kTypes));

// A door that is open by a right angle, with its hinge at its edge.
TEST(PlacedChild, OfADoor) {
  JointForm door;
  door.type = JointType::kRevolute;
  const Quaterniond upright = rotation_by(-std::numbers::pi / 2 * Vector3d::UnitY());  // x to z
  door.in_parent = {{1, 0, 0}, upright};
  door.in_child = {{-0.5, 0, 0}, upright};
  JointPlace place;
  place.position[0] = std::numbers::pi / 2;
  place.velocity[0] = 2;
  const JointSide child = placed_child(door, {}, place);
  EXPECT_NEAR((child.pose.position - Vector3d(1, 0.5, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((child.angular_velocity - Vector3d(0, 0, 2)).norm(), 0, 1e-12);
  EXPECT_NEAR((child.linear_velocity - Vector3d(-1, 0, 0)).norm(), 0, 1e-12);
}

}  // namespace
}  // namespace tessera
