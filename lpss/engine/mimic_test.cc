// Axes that follow others.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "lpss/engine/joint_scene.h"

namespace tessera::engine_tests {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

constexpr double kWheel = 1.0 / 6;  // kg m^2, of a link about its centre
constexpr std::uint64_t kOther = kLink + 1;

// Of what is in double precision up to the poses of bodies.
double follower_error_max() { return test_precision == Precision::kFloat32 ? 2e-5 : 1e-7; }

class MimicTest : public testing::Test {
 protected:
  MimicTest() : engine_(test_engine(test_settings())), scene_(*engine_) {}

  // Two links without gravity that turn or slide along z, on the world or on a free base. The second follows
  // the first.
  void add_pair(JointType leader, JointType follower, const AxisMimic& mimic, std::uint64_t parent = 0) {
    scene_.add(ghost(kLink, {-1, 0, 0}), 0, kNoGravity);
    scene_.add(ghost(kOther, {1, 0, 0}), 0, kNoGravity);
    scene_.tie(leader, parent, kLink, frame_at({-1, 0, 0}, {0, 0, 1}));
    scene_.tie(follower, parent, kOther, frame_at({1, 0, 0}, {0, 0, 1}));
    AxisMimic& into = scene_.axis(1).mimic = mimic;
    into.leader = JointId{1};
  }

  double position(std::size_t joint) const { return scene_.joint_state(joint).position[0]; }
  double velocity(std::size_t joint) const { return scene_.joint_state(joint).velocity[0]; }

  std::unique_ptr<Engine> engine_;
  JointScene scene_;
};

TEST_F(MimicTest, FollowsAndWeighsOnItsLeader) {
  add_pair(JointType::kRevolute, JointType::kRevolute, {{}, 0, -2, 0.1, -0.2});
  scene_.drive(0) = {DriveMode::kEffort, 0.3};
  for (int tick = 0; tick < 60; ++tick) {
    scene_.step();
    ASSERT_NEAR(position(1), std::remainder(-2 * (position(0) - 0.1) - 0.2, 2 * pi), follower_error_max());
  }
  EXPECT_NEAR(velocity(0), 0.3 / (kWheel + 4 * kWheel), 1e-4);
  EXPECT_NEAR(velocity(1), -2 * velocity(0), 1e-5);
}

TEST_F(MimicTest, LeadsByWhatPushesTheFollower) {
  add_pair(JointType::kRevolute, JointType::kRevolute, {{}, 0, -2, 0, 0});
  scene_.drive(1) = {DriveMode::kEffort, 0.3};
  scene_.run(1);
  EXPECT_NEAR(velocity(0), -2 * 0.3 / (kWheel + 4 * kWheel), 1e-4);
}

TEST_F(MimicTest, RackKeepsItsPlaceOverManyTurns) {
  add_pair(JointType::kRevolute, JointType::kPrismatic, {{}, 0, 0.05, 0, 0});
  scene_.drive(0) = {DriveMode::kVelocity, 10};
  double turned = 0;
  double before = 0;
  for (int tick = 0; tick < 600; ++tick) {
    scene_.step();
    turned += std::remainder(position(0) - before, 2 * pi);
    before = position(0);
    ASSERT_NEAR(position(1), 0.05 * turned, follower_error_max());
  }
  EXPECT_GT(turned, 90);
}

// What is known of free angles are whole turns, of which a gear of 37 to 10 teeth makes tenths.
TEST_F(MimicTest, GearOfABrokenRatioLosesNoTooth) {
  add_pair(JointType::kRevolute, JointType::kRevolute, {{}, 0, -3.7, 0, 0});
  scene_.drive(0) = {DriveMode::kVelocity, 5};
  double turned[2] = {0, 0};
  double before[2] = {0, 0};
  for (int tick = 0; tick < 600; ++tick) {
    scene_.step();
    for (const std::size_t n : {0u, 1u}) {
      turned[n] += std::remainder(position(n) - before[n], 2 * pi);
      before[n] = position(n);
    }
    ASSERT_NEAR(turned[1], -3.7 * turned[0], 10 * follower_error_max());
  }
  EXPECT_GT(turned[0], 45);
}

TEST_F(MimicTest, ComesToItsPlace) {
  add_pair(JointType::kRevolute, JointType::kPrismatic, {{}, 0, 1, 0, 0.4});
  scene_.axis(0).friction = 1e6;
  scene_.run(2);
  EXPECT_NEAR(position(1), position(0) + 0.4, follower_error_max());
  EXPECT_NEAR(velocity(1), 0, 1e-5);
}

TEST_F(MimicTest, StopsWithTheLimitOfTheFollower) {
  add_pair(JointType::kRevolute, JointType::kPrismatic, {{}, 0, 0.5, 0, 0});
  scene_.axis(1).lower = -1;
  scene_.axis(1).upper = 0.25;
  scene_.axis(0).effort_max = 3;
  scene_.drive(0) = {DriveMode::kVelocity, 1};
  scene_.run(2);
  EXPECT_NEAR(position(1), 0.25, 0.002);
  EXPECT_NEAR(position(0), 0.5, 0.004);
}

TEST_F(MimicTest, OfAFreeBaseKeepsMomentum) {
  scene_.add(ghost(kBase, {0, 0, 0}), 0, kNoGravity);
  add_pair(JointType::kRevolute, JointType::kRevolute, {{}, 0, 3, 0, 0}, kBase);
  scene_.drive(0) = {DriveMode::kEffort, 0.2};
  scene_.run(1);
  Vector3d linear = Vector3d::Zero();
  Vector3d angular = Vector3d::Zero();
  for (const std::uint64_t id : {kBase, kLink, kOther}) {
    const BodyState state = scene_.state(id);
    const Vector3d velocity(state.linear_velocity.data());
    linear += velocity;
    angular +=
        Vector3d(state.position.data()).cross(velocity) + Vector3d(state.angular_velocity.data()) * kWheel;
  }
  EXPECT_GT(std::abs(velocity(1)), 0.1);
  EXPECT_NEAR(velocity(1), 3 * velocity(0), 1e-4);
  EXPECT_LT(linear.norm(), 1e-5);
  EXPECT_LT(angular.norm(), 1e-5);
}

TEST_F(MimicTest, OfASpringSwingsWithBothMasses) {
  add_pair(JointType::kRevolute, JointType::kRevolute, {{}, 0, 2, 0, 0});
  const double rate = pi;  // rad/s
  scene_.axis(0).spring_stiffness = rate * rate * 5 * kWheel;
  scene_.axis(0).spring_reference = 0.2;
  scene_.run(1);  // half a period
  EXPECT_NEAR(position(0), 0.4, 0.4 * rate * kTick);
  EXPECT_NEAR(position(1), 0.8, 0.8 * rate * kTick);
}

TEST_F(MimicTest, EndsWithItsLeader) {
  add_pair(JointType::kRevolute, JointType::kRevolute, {{}, 0, 2, 0, 0});
  scene_.axis(1).mimic.leader = JointId{77};
  scene_.drive(0) = {DriveMode::kVelocity, 1};
  scene_.run(1);
  EXPECT_NEAR(velocity(0), 1, 1e-3);
  EXPECT_NEAR(velocity(1), 0, 1e-6);
}

// The two chains have no body in common, and live in different sectors.
TEST(MimicSectorsTest, ReachesOverSectors) {
  const auto engine = test_engine(test_settings());
  std::uint64_t hashes[2] = {};
  for (const int sectors : {1, 2}) {
    JointScene scene(*engine, sectors);
    scene.add(ghost(kLink, {60, 0, 0}), 0, kNoGravity);
    scene.add(ghost(kOther, {68, 0, 0}), sectors - 1, kNoGravity);
    scene.tie(JointType::kRevolute, 0, kLink, frame_at({60, 0, 0}, {0, 0, 1}));
    scene.tie(JointType::kRevolute, 0, kOther, frame_at({68, 0, 0}, {0, 0, 1}));
    scene.axis(1).mimic = {JointId{1}, 0, 2, 0, 0};
    scene.drive(0) = {DriveMode::kVelocity, 1};
    scene.run(1);
    EXPECT_NEAR(scene.joint_state(1).velocity[0], 2, 1e-3);
    hashes[sectors - 1] = scene.hash();
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

}  // namespace
}  // namespace tessera::engine_tests
