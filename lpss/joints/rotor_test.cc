#include "lpss/joints/rotor.h"

#include <gtest/gtest.h>

#include "lpss/base/rotation.h"

namespace tessera::joints {
namespace {

using Eigen::Vector3d;

constexpr double kMassInverse = 0.5;             // 1/kg
const Vector3d kWheelInverse(100, 100, 50);      // 1/(kg m^2), about an axle along z: a radius of 0.2 m
const Vector3d kNearlyInverse(100, 100.05, 50);  // the same, but for errors of a model
const Vector3d kBrickInverse(100, 110, 50);

// A joint whose axis is the body's z, turned off it and moved away from its centre of mass.
Pose joint_frame(const Vector3d& position = Vector3d::Zero(), double off = 0) {
  const Eigen::Quaterniond along_z = rotation_by(Vector3d::UnitY() * -1.5707963267948966);
  return {position, rotation_by(Vector3d::UnitX() * off) * along_z};
}

std::optional<Vector3d> axis_of(JointType type, bool is_child, const Pose& frame, const Vector3d& inverse) {
  RotorSearch search;
  search.add(type, is_child, frame, kMassInverse, inverse);
  return search.axis();
}

TEST(Rotor, IsWhatAJointLetsTurnAboutItsAxisOfSymmetry) {
  for (const bool is_child : {true, false}) {
    const auto axis = axis_of(JointType::kRevolute, is_child, joint_frame({0, 0, 0.7}), kWheelInverse);
    ASSERT_TRUE(axis.has_value());
    EXPECT_LT((*axis - Vector3d::UnitZ()).norm(), 1e-12);
  }
  EXPECT_TRUE(axis_of(JointType::kRevolute, true, joint_frame({1e-5, 0, 0}, 1e-4), kNearlyInverse));
}

TEST(Rotor, IsNotOutOfBalance) {
  EXPECT_FALSE(axis_of(JointType::kRevolute, true, joint_frame(), kBrickInverse));
  EXPECT_FALSE(axis_of(JointType::kRevolute, true, joint_frame({0.01, 0, 0}), kWheelInverse));
  EXPECT_FALSE(axis_of(JointType::kRevolute, true, joint_frame({0, 0, 0}, 0.01), kWheelInverse));
}

TEST(Rotor, IsNotHeldInAnyOtherWay) {
  for (const JointType type :
       {JointType::kFixed, JointType::kBall, JointType::kPrismatic, JointType::kUniversal}) {
    EXPECT_FALSE(axis_of(type, true, joint_frame(), kWheelInverse));
  }
  // Where a screw is, is known by the angle of its child.
  EXPECT_TRUE(axis_of(JointType::kScrew, true, joint_frame(), kWheelInverse));
  EXPECT_FALSE(axis_of(JointType::kScrew, false, joint_frame(), kWheelInverse));
}

TEST(Rotor, MayHaveSeveralJointsAboutOneAxis) {
  RotorSearch search;
  search.add(JointType::kRevolute, true, joint_frame({0, 0, 0.2}), kMassInverse, kWheelInverse);
  search.add(JointType::kScrew, true, joint_frame({0, 0, -0.3}), kMassInverse, kWheelInverse);
  EXPECT_TRUE(search.axis());
  search.add(JointType::kBall, false, joint_frame(), kMassInverse, kWheelInverse);
  EXPECT_FALSE(search.axis());
  search.add(JointType::kRevolute, true, joint_frame(), kMassInverse, kWheelInverse);
  EXPECT_FALSE(search.axis());
}

// Whose moments are all alike has an axis by its joints alone.
TEST(Rotor, HasOneAxis) {
  const Vector3d ball(100, 100, 100);
  RotorSearch search;
  search.add(JointType::kRevolute, true, joint_frame(), kMassInverse, ball);
  EXPECT_TRUE(search.axis());
  search.add(JointType::kRevolute, false, {Vector3d::Zero(), Eigen::Quaterniond::Identity()}, kMassInverse,
             ball);
  EXPECT_FALSE(search.axis());
}

}  // namespace
}  // namespace tessera::joints
