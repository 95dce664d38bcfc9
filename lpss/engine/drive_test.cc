// What moves the free axes of joints, and what stops them: drives, limits, damping and friction.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <ostream>

#include "lpss/engine/joint_scene.h"

namespace tessera::engine_tests {
namespace {

using Eigen::Vector3d;

constexpr double kInertia = 1.0 / 6;     // of a link, kg m^2
constexpr double kLever = 0.5;           // m, from the axis of an arm to its centre
constexpr double kLoad = 9.81 * kLever;  // N m, of an arm that is held out

// A link that turns about its own centre, or slides, without gravity.
std::size_t add_free(JointScene& scene, JointType type) {
  scene.add(ghost(kLink, {0, 0, 0}), 0, kNoGravity);
  return scene.tie(type, 0, kLink, frame_at({0, 0, 0}, {0, 0, 1}));
}

// A link that is held out sideways; positive angles lift it.
std::size_t add_arm(JointScene& scene) {
  scene.add(ghost(kLink, {kLever, 0, 0}));
  return scene.tie(JointType::kRevolute, 0, kLink, frame_at({0, 0, 0}, {0, -1, 0}));
}

// An axis between two bodies that are free to move.
struct Driven {
  const char* name;
  JointType type;
  std::size_t axis;

  friend void PrintTo(const Driven& driven, std::ostream* out) { *out << driven.name; }
};

class DriveTest : public testing::TestWithParam<Driven> {
 protected:
  DriveTest() : engine_(test_engine(test_settings())), scene_(*engine_) {
    BodyRecord base = ghost(kBase, {0, 0, 0});
    base.properties.mass = 20;
    base.properties.inertia = {5, 4, 3};
    base.state.angular_velocity = {0.1, 0.2, 0.3};
    scene_.add(base, 0, kNoGravity);
    scene_.add(ghost(kLink, {0.3, 0.4, 0.5}), 0, kNoGravity);
    scene_.tie(GetParam().type, kBase, kLink, frame_at({0.3, 0.2, 0.1}, {0.48, 0.6, 0.64}));
    scene_.joint(0).pitch = 0.1;
  }

  JointAxis& axis() { return scene_.joint(0).axes[GetParam().axis]; }
  JointDrive& drive() { return scene_.drive(0, GetParam().axis); }
  double position() const { return scene_.joint_state(0).position[GetParam().axis]; }
  double velocity() const { return scene_.joint_state(0).velocity[GetParam().axis]; }

  std::unique_ptr<Engine> engine_;
  JointScene scene_;
};

TEST_P(DriveTest, ReachesItsVelocity) {
  for (double target : {0.6, -0.4}) {
    drive() = {DriveMode::kVelocity, target};
    const double before = position();
    scene_.run(1);
    EXPECT_NEAR(velocity(), target, 0.002);
    EXPECT_NEAR(position() - before, target, 0.02);
  }
}

TEST_P(DriveTest, GoesToItsPosition) {
  for (double target : {0.7, -0.3}) {
    drive() = {DriveMode::kPosition, target};
    scene_.run(2);
    EXPECT_NEAR(position(), target, 0.002);
    EXPECT_NEAR(velocity(), 0, 0.002);
  }
}

TEST_P(DriveTest, StopsAtItsLimits) {
  axis().lower = -0.2;
  axis().upper = 0.4;
  axis().effort_max = 3;
  double low = 0;
  double high = 0;
  for (double target : {2.0, -2.0, 2.0}) {
    drive() = {DriveMode::kVelocity, target};
    for (int tick = 0; tick < 60; ++tick) {
      scene_.step();
      low = std::min(low, position());
      high = std::max(high, position());
    }
    EXPECT_NEAR(position(), target > 0 ? 0.4 : -0.2, 0.002);
  }
  EXPECT_GT(low, -0.205);
  EXPECT_LT(high, 0.405);
}

TEST_P(DriveTest, OfAnyStrengthStopsAtItsLimits) {
  axis().lower = -0.2;
  axis().upper = 0.4;
  drive() = {DriveMode::kVelocity, 1};
  for (int tick = 0; tick < 120; ++tick) {
    scene_.step();
    ASSERT_LT(position(), 0.405);
  }
  EXPECT_NEAR(position(), 0.4, 0.002);
}

INSTANTIATE_TEST_SUITE_P(Axes, DriveTest,
                         testing::Values(Driven{"Revolute", JointType::kRevolute, 0},
                                         Driven{"Prismatic", JointType::kPrismatic, 0},
                                         Driven{"UniversalFirst", JointType::kUniversal, 0},
                                         Driven{"UniversalSecond", JointType::kUniversal, 1},
                                         Driven{"Screw", JointType::kScrew, 0}),
                         testing::PrintToStringParamName());

TEST(LimitTest, HoldsALoadWithoutABounce) {
  const auto engine = test_engine(test_settings());
  JointScene scene(*engine);
  const std::size_t arm = add_arm(scene);
  scene.axis(arm).lower = -1;
  scene.axis(arm).upper = 0.5;
  bool has_arrived = false;
  for (int tick = 0; tick < 300; ++tick) {
    scene.step();
    const double angle = scene.joint_state(arm).position[0];
    ASSERT_GT(angle, -1.001);
    has_arrived = has_arrived || angle < -0.999;
    ASSERT_TRUE(!has_arrived || angle < -0.998) << angle;
  }
  EXPECT_TRUE(has_arrived);
}

TEST(LimitTest, KnowsItsSideBeyondHalfATurn) {
  const auto engine = test_engine(test_settings());
  JointScene scene(*engine);
  const std::size_t hinge = add_free(scene, JointType::kRevolute);
  scene.axis(hinge).upper = 3.1;
  scene.axis(hinge).lower = -0.1;
  // Half a turn and 0.06 more, where the angle reads as -3.08.
  BodyState state = scene.state(kLink);
  state.rotation = rotation_of(Eigen::Quaterniond(Eigen::AngleAxisd(3.2, Vector3d::UnitZ())));
  scene.set_state(kLink, state);
  scene.run(1);
  EXPECT_NEAR(scene.joint_state(hinge).position[0], 3.0, 0.01);
}

TEST(LimitTest, OfNoRangeHolds) {
  const auto engine = test_engine(test_settings());
  JointScene scene(*engine);
  const std::size_t arm = add_arm(scene);
  scene.axis(arm).lower = 0;
  scene.axis(arm).upper = 0;
  scene.run(5);
  EXPECT_NEAR(scene.joint_state(arm).position[0], 0, 0.001);
}

TEST(EffortTest, OfAVelocityDriveIsBounded) {
  const auto engine = test_engine(test_settings());
  JointScene strong(*engine);
  JointScene weak(*engine);
  for (JointScene* scene : {&strong, &weak}) {
    const std::size_t arm = add_arm(*scene);
    scene->drive(arm) = {DriveMode::kVelocity, 0.5};
    scene->axis(arm).effort_max = scene == &strong ? 1.3 * kLoad : 0.7 * kLoad;
    scene->run(0.5);
  }
  EXPECT_NEAR(strong.joint_state(0).velocity[0], 0.5, 0.002);
  EXPECT_LT(weak.joint_state(0).velocity[0], -0.5);
}

TEST(EffortTest, OfAPositionDriveIsBounded) {
  const auto engine = test_engine(test_settings());
  JointScene strong(*engine);
  JointScene weak(*engine);
  for (JointScene* scene : {&strong, &weak}) {
    const std::size_t arm = add_arm(*scene);
    scene->drive(arm) = {DriveMode::kPosition, 0};
    scene->axis(arm).effort_max = scene == &strong ? 1.3 * kLoad : 0.7 * kLoad;
    scene->run(1);
  }
  EXPECT_NEAR(strong.joint_state(0).position[0], 0, 0.001);
  EXPECT_LT(weak.joint_state(0).position[0], -0.5);
}

TEST(EffortTest, AcceleratesAFreeAxisByTheBook) {
  const auto engine = test_engine(test_settings());
  JointScene turned(*engine);
  JointScene pushed(*engine);
  turned.drive(add_free(turned, JointType::kRevolute)) = {DriveMode::kEffort, 0.3};
  pushed.drive(add_free(pushed, JointType::kPrismatic)) = {DriveMode::kEffort, -0.3};
  turned.run(2);
  pushed.run(2);
  EXPECT_NEAR(turned.joint_state(0).velocity[0], 2 * 0.3 / kInertia, 1e-4);
  EXPECT_NEAR(pushed.joint_state(0).velocity[0], -2 * 0.3, 1e-4);
  EXPECT_NEAR(pushed.joint_state(0).position[0], -0.3 * 2 * 2 / 2, 0.01);
}

TEST(EffortTest, IsBoundedItself) {
  const auto engine = test_engine(test_settings());
  JointScene scene(*engine);
  const std::size_t hinge = add_free(scene, JointType::kRevolute);
  scene.axis(hinge).effort_max = 0.1;
  scene.drive(hinge) = {DriveMode::kEffort, 7};
  scene.run(1);
  EXPECT_NEAR(scene.joint_state(hinge).velocity[0], 0.1 / kInertia, 1e-4);
}

TEST(PositionDriveTest, KeepsItsVelocityMax) {
  const auto engine = test_engine(test_settings());
  JointScene scene(*engine);
  const std::size_t hinge = add_free(scene, JointType::kRevolute);
  scene.axis(hinge).velocity_max = 0.5;
  scene.drive(hinge) = {DriveMode::kPosition, 1};
  scene.run(1);
  EXPECT_NEAR(scene.joint_state(hinge).position[0], 0.5, 0.001);
  for (int tick = 0; tick < 180; ++tick) {
    scene.step();
    ASSERT_LT(scene.joint_state(hinge).velocity[0], 0.5001);
    ASSERT_LT(scene.joint_state(hinge).position[0], 1.0001);
  }
  EXPECT_NEAR(scene.joint_state(hinge).position[0], 1, 0.0001);
}

TEST(PositionDriveTest, TurnsTheShortWay) {
  const auto engine = test_engine(test_settings());
  JointScene scene(*engine);
  const std::size_t hinge = add_free(scene, JointType::kRevolute);
  scene.drive(hinge) = {DriveMode::kPosition, 3};
  scene.run(2);
  scene.drive(hinge) = {DriveMode::kPosition, -3};
  for (int tick = 0; tick < 120; ++tick) {
    scene.step();
    ASSERT_GT(std::abs(scene.joint_state(hinge).position[0]), 2.99);
  }
  EXPECT_NEAR(scene.joint_state(hinge).position[0], -3, 0.001);
}

TEST(PositionDriveTest, TurnsTheWayThatItsLimitsLeave) {
  const auto engine = test_engine(test_settings());
  JointScene scene(*engine);
  const std::size_t hinge = add_free(scene, JointType::kRevolute);
  scene.axis(hinge).lower = -3.05;
  scene.axis(hinge).upper = 3.05;
  double least = 3;
  for (double target : {3.0, -3.0}) {
    scene.drive(hinge) = {DriveMode::kPosition, target};
    for (int tick = 0; tick < 120; ++tick) {
      scene.step();
      if (target < 0) least = std::min(least, std::abs(scene.joint_state(hinge).position[0]));
    }
    EXPECT_NEAR(scene.joint_state(hinge).position[0], target, 0.001);
  }
  EXPECT_LT(least, 0.5);
}

TEST(DampingTest, SlowsAsTheBookSays) {
  const auto engine = test_engine(test_settings());
  for (double rate : {0.01, 1.0, 5.0}) {  // damping / inertia, 1/s
    JointScene scene(*engine);
    const std::size_t hinge = add_free(scene, JointType::kRevolute);
    BodyState state = scene.state(kLink);
    state.angular_velocity = {0, 0, 2};
    scene.set_state(kLink, state);
    scene.axis(hinge).damping = rate * kInertia;
    scene.run(1);
    // Implicit in each small step: exactly this, and near the exponential.
    const double velocity = scene.joint_state(hinge).velocity[0];
    const int steps = engine->settings().substeps;
    EXPECT_NEAR(velocity, 2 * std::pow(1 + rate * kTick / steps, -60 * steps), 1e-4) << rate;
    EXPECT_NEAR(velocity, 2 * std::exp(-rate), 0.02) << rate;
  }
}

TEST(DampingTest, OfAnyStrengthIsStable) {
  const auto engine = test_engine(test_settings());
  for (double damping : {1e-9, 1e-3, 1e3, 1e9}) {
    JointScene scene(*engine);
    const std::size_t arm = add_arm(scene);
    scene.axis(arm).damping = damping;
    scene.run(5);
    EXPECT_LT(std::abs(scene.joint_state(arm).velocity[0]), 10) << damping;
    if (damping > 1) {
      EXPECT_NEAR(scene.joint_state(arm).velocity[0], -kLoad / damping, 0.1 * kLoad / damping + 1e-5)
          << damping;
    }
  }
}

TEST(FrictionTest, HoldsBelowItsBoundOnly) {
  const auto engine = test_engine(test_settings());
  JointScene holding(*engine);
  JointScene slipping(*engine);
  for (JointScene* scene : {&holding, &slipping}) {
    const std::size_t arm = add_arm(*scene);
    scene->axis(arm).friction = scene == &holding ? 1.1 * kLoad : 0.9 * kLoad;
    scene->run(5);
  }
  EXPECT_NEAR(holding.joint_state(0).position[0], 0, 0.005);
  EXPECT_LT(slipping.joint_state(0).position[0], -0.2);
}

TEST(FrictionTest, IsTakenOffADrive) {
  const auto engine = test_engine(test_settings());
  JointScene scene(*engine);
  const std::size_t hinge = add_free(scene, JointType::kRevolute);
  scene.axis(hinge).friction = 0.2;
  scene.drive(hinge) = {DriveMode::kEffort, 0.5};
  scene.run(1);
  EXPECT_NEAR(scene.joint_state(hinge).velocity[0], 0.3 / kInertia, 0.01);
  scene.drive(hinge) = {DriveMode::kEffort, 0};
  scene.run(0.5);
  EXPECT_NEAR(scene.joint_state(hinge).velocity[0], 0.2 / kInertia, 0.01);
  scene.run(2);
  EXPECT_NEAR(scene.joint_state(hinge).velocity[0], 0, 1e-5);
}

}  // namespace
}  // namespace tessera::engine_tests
