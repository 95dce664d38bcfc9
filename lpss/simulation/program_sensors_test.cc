// Sensors against what mechanics says they must show.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "lpss/simulation/program_scenes.h"

namespace tessera {
namespace {

Eigen::Vector3d vector_of(const BodyRecord& body, const std::string& name) {
  return {value_of(body, name + "_x"), value_of(body, name + "_y"), value_of(body, name + "_z")};
}

TEST(Imu, FeelsNothingInFreeFallAndTheGroundAtRest) {
  WorldBuilder builder(settings_of());
  builder.add_floor(50, 0);
  add_box(builder, "box", {0.5, 0.5, 0.5}, {0.1, 0.2, 5}, Motion::kDynamic)
      .programs.push_back(example_program("imu"));
  Watched world(builder);
  world.step();
  EXPECT_EQ(value_of(world.body("box"), "measures"), 1);
  world.run(0.5);
  EXPECT_NEAR(vector_of(world.body("box"), "acceleration").norm(), 0, 1e-3);
  world.run(3);
  const BodyRecord body = world.body("box");
  EXPECT_NEAR((vector_of(body, "acceleration") - Eigen::Vector3d(0, 0, kG)).norm(), 0, 1e-2);
  EXPECT_NEAR(vector_of(body, "turn").norm(), 0, 1e-3);
}

TEST(Imu, MeasuresAlongItsOwnAxes) {
  const double angle = 20 * EIGEN_PI / 180;
  WorldBuilder builder(settings_of());
  add_slope(builder, angle);
  BodyDescription& box = add_box(builder, "box", {0.5, 0.5, 0.5}, {0, 0, 0}, Motion::kDynamic);
  box.pose.orientation = Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitY());
  box.pose.position.local = box.pose.orientation * Eigen::Vector3d(0, 0, 0.25);
  box.programs.push_back(example_program("imu"));
  Watched world(builder);
  world.run(2);
  const Eigen::Vector3d felt = vector_of(world.body("box"), "acceleration");
  EXPECT_NEAR(felt.x(), kG * std::sin(angle), 1e-2);
  EXPECT_NEAR(felt.y(), 0, 1e-2);
  EXPECT_NEAR(felt.z(), kG * std::cos(angle), 1e-2);
}

// Away from the axis: w^2 r towards it. The chord of a tick is shorter than its arc by (w dt)^2 / 24.
TEST(Imu, FeelsWhatTurningTakes) {
  constexpr double kRate = 6;  // rad/s
  constexpr double kRadius = 0.5;
  WorldSettings settings = settings_of();
  settings.gravity = UniformGravity{{0, 0, 0}};
  WorldBuilder builder(settings);
  BodyDescription& disc = builder.add("disc", builder.shape(Cylinder{1, 0.2}), 2, {0.1, 0.2, 1});
  disc.angular_velocity = {0, 0, kRate};
  disc.programs.push_back(example_program("imu", {{"x", kRadius}}));
  Watched world(builder);
  world.run(1);
  const BodyRecord body = world.body("disc");
  const double expected = -kRate * kRate * kRadius;
  EXPECT_NEAR(vector_of(body, "acceleration").x() / expected, 1, 5e-4);
  EXPECT_NEAR(vector_of(body, "acceleration").y(), 0, 5e-3);
  EXPECT_NEAR(vector_of(body, "turn").z(), kRate, 1e-5);
}

TEST(Imu, HasTheNoiseThatItIsGiven) {
  WorldSettings settings = settings_of();
  settings.gravity = UniformGravity{{0, 0, 0}};
  settings.sleep_after = 0;
  WorldBuilder builder(settings);
  add_box(builder, "box", {0.5, 0.5, 0.5}, {0.1, 0.2, 5}, Motion::kDynamic)
      .programs.push_back(example_program("imu", {{"noise", 0.2}, {"turn_noise", 0.03}}));
  Watched world(builder);
  constexpr int kTicks = 1000;
  double squares = 0;
  double turn_squares = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (int tick = 0; tick < kTicks; ++tick) {
    world.step();
    squares += vector_of(world.body("box"), "acceleration").squaredNorm();
    turn_squares += vector_of(world.body("box"), "turn").squaredNorm();
    mean += vector_of(world.body("box"), "acceleration") / kTicks;
  }
  EXPECT_NEAR(std::sqrt(squares / (3 * kTicks)), 0.2, 0.2 * 0.05);
  EXPECT_NEAR(std::sqrt(turn_squares / (3 * kTicks)), 0.03, 0.03 * 0.05);
  EXPECT_NEAR(mean.norm(), 0, 0.03);
}

// A post bears an arm that sticks out by its half: its weight, and the moment of that.
TEST(LoadSensor, ShowsTheWeightAndMomentOfWhatAJointBears) {
  constexpr double kMass = 3;
  WorldBuilder builder(settings_of(2));
  add_box(builder, "arm", {1, 0.1, 0.1}, {0.5, 0.2, 0.2}, Motion::kDynamic, kMass);
  builder.tie("root", JointType::kFixed, "", "arm", {0, 0.2, 0.2});
  add_box(builder, "desk", {0.2, 0.2, 0.2}, {-4.1, 0.2, 0.2}, Motion::kKinematic)
      .programs.push_back(example_program("load", {{"joint", 1}}));
  for (const std::uint32_t partitions : {1u, 4u}) {
    Watched world(builder, partitions);
    world.run(1);
    const BodyRecord desk = world.body("desk");
    EXPECT_NEAR((vector_of(desk, "force") - Eigen::Vector3d(0, 0, kMass * kG)).norm(), 0, 0.02);
    // The joint lifts the arm's far end, about -y.
    EXPECT_NEAR((vector_of(desk, "torque") - Eigen::Vector3d(0, -kMass * kG * 0.5, 0)).norm(), 0, 0.02);
    world.step({RemoveJoint{JointId{1}}});
    EXPECT_EQ(vector_of(world.body("desk"), "force").norm(), 0);
  }
}

// It falls by g t^2 / 2.
TEST(Altimeter, MeasuresAFallOverSectors) {
  WorldBuilder builder(settings_of(1));
  add_box(builder, "box", {0.2, 0.2, 0.2}, {0.1, 0.2, 5}, Motion::kDynamic)
      .programs.push_back(example_program("altimeter"));
  Watched world(builder, 4);
  world.step();
  const double start = value_of(world.body("box"), "height");
  const double speed = value_of(world.body("box"), "climb");
  world.run(1.5);
  EXPECT_NEAR(value_of(world.body("box"), "height") - start, speed * 1.5 - kG * 1.5 * 1.5 / 2, 0.02);
  EXPECT_NEAR(value_of(world.body("box"), "climb") - speed, -kG * 1.5, 1e-3);
  EXPECT_NEAR(value_of(world.body("box"), "height"), world.position("box").z() - 5, 1e-9);
}

TEST(Altimeter, HasTheNoiseThatItIsGiven) {
  WorldSettings settings = settings_of();
  settings.gravity = UniformGravity{{0, 0, 0}};
  settings.sleep_after = 0;
  WorldBuilder builder(settings);
  add_box(builder, "box", {0.5, 0.5, 0.5}, {0.1, 0.2, 5}, Motion::kDynamic)
      .programs.push_back(example_program("altimeter", {{"noise", 0.5}, {"climb_noise", 0.1}}));
  Watched world(builder);
  constexpr int kTicks = 1000;
  double squares = 0;
  double climb_squares = 0;
  for (int tick = 0; tick < kTicks; ++tick) {
    world.step();
    squares += std::pow(value_of(world.body("box"), "height"), 2);
    climb_squares += std::pow(value_of(world.body("box"), "climb"), 2);
  }
  EXPECT_NEAR(std::sqrt(squares / kTicks), 0.5, 0.5 * 0.1);
  EXPECT_NEAR(std::sqrt(climb_squares / kTicks), 0.1, 0.1 * 0.1);
}

}  // namespace
}  // namespace tessera
