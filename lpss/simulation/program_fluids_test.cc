// What swims, and what is led by velocities, against what mechanics says.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "lpss/simulation/program_scenes.h"

namespace tessera {
namespace {

WorldSettings in_water() {
  WorldSettings settings = settings_of(64);
  settings.gravity = UniformGravity{{0, 0, 0}};
  return settings;
}

// F = (m + M) a, from rest.
TEST(Hydrodynamics, WaterSpeedsUpWithItsBody) {
  WorldBuilder builder(in_water());
  BodyDescription& hull = add_box(builder, "hull", {1, 1, 1}, {0.1, 0.2, 0}, Motion::kDynamic, 4);
  hull.pose.orientation = Eigen::AngleAxisd(EIGEN_PI / 2, Eigen::Vector3d::UnitZ());
  hull.programs.push_back(example_program("thruster", {{"force", 10}, {"throttle", 1}}));
  hull.programs.push_back(example_program("hydrodynamics", {{"mass_x", 12}, {"mass_y", 100}}));
  Watched world(builder);
  world.run(2);
  EXPECT_NEAR(world.velocity("hull").y(), 10.0 / (4 + 12) * 2, 10.0 / 4 * 2 * kDt);
}

// A plate that moves at an angle is turned across its way: by v x (A v), Munk's moment.
TEST(Hydrodynamics, TurnsALongBodyAcrossItsWay) {
  WorldBuilder builder(in_water());
  BodyDescription& hull = add_box(builder, "hull", {2, 0.5, 0.5}, {0.1, 0.2, 0}, Motion::kDynamic, 100);
  hull.linear_velocity = {0.5, 0.05, 0};
  hull.programs.push_back(example_program("hydrodynamics", {{"mass_x", 10}, {"mass_y", 80}}));
  Watched world(builder);
  constexpr double kSeconds = 0.5;
  world.run(kSeconds);
  const double inertia = 100.0 / 12 * (2 * 2 + 0.5 * 0.5);
  const double moment = 0.5 * 0.05 * (80 - 10);
  EXPECT_NEAR(world.body("hull").state.angular_velocity[2], -moment / inertia * kSeconds,
              0.1 * moment / inertia * kSeconds);
}

TEST(Hydrodynamics, NoDragIsTooLargeForATick) {
  WorldBuilder builder(in_water());
  BodyDescription& hull = add_box(builder, "hull", {1, 1, 1}, {0.1, 0.2, 0}, Motion::kDynamic, 1);
  hull.linear_velocity = {50, 0, 0};
  hull.angular_velocity = {0, 0, 20};
  hull.programs.push_back(example_program(
      "hydrodynamics",
      {{"drag_x", 1e9}, {"drag_y", 1e9}, {"turn_drag_z", 1e9}, {"square_drag_x", 1e9}, {"mass_x", 1e6}}));
  Watched world(builder);
  double before = 1e9;
  for (int tick = 0; tick < 120; ++tick) {
    world.step();
    const double now = world.velocity("hull").norm();
    EXPECT_LE(now, before + 1e-6);
    before = now;
  }
  EXPECT_LT(before, 1e-3);
  EXPECT_TRUE(world.body("hull").programs[0].fault.empty());
}

// Lifted above its centre of mass, a submerged ball is a pendulum: T = 2 pi sqrt(I / (density V g h)).
TEST(Floater, LiftsAtTheMiddleOfItsBox) {
  constexpr double kAbove = 0.1;
  WorldBuilder builder(settings_of());
  BodyDescription& pod = add_box(builder, "pod", {0.5, 0.5, 0.5}, {0.3, 0.2, 0}, Motion::kDynamic, 125);
  pod.pose.orientation = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX());
  pod.programs.push_back(example_program("floater", {{"level", 1e4},
                                                     {"length", 0.5},
                                                     {"width", 0.5},
                                                     {"height", 0.5},
                                                     {"drag", 0},
                                                     {"damping", 0},
                                                     {"z", kAbove}}));
  Watched world(builder);
  const double inertia = 125 * 0.5 * 0.5 / 6;
  const double period = 2 * EIGEN_PI * std::sqrt(inertia / (125 * kG * kAbove));
  std::vector<double> crossed;
  double before = 0.1;
  for (int tick = 1; tick < 600; ++tick) {
    world.step();
    const double now = world.body("pod").state.rotation[7];
    if (before < 0 && now >= 0) crossed.push_back(tick * kDt);
    before = now;
  }
  ASSERT_GE(crossed.size(), 3u);
  EXPECT_NEAR((crossed.back() - crossed.front()) / static_cast<double>(crossed.size() - 1), period,
              0.03 * period);
}

// m g - air V g, of a balloon far above the water.
TEST(Floater, AirLiftsToo) {
  WorldBuilder builder(settings_of());
  add_box(builder, "balloon", {1, 1, 1}, {0.3, 0.2, 0}, Motion::kDynamic, 0.6)
      .programs.push_back(example_program("floater", {{"level", -5}, {"air", 1.2}}));
  Watched world(builder);
  world.run(1);
  EXPECT_NEAR(world.velocity("balloon").z(), kG * (1.2 - 0.6) / 0.6, 0.05 * kG);
  EXPECT_EQ(value_of(world.body("balloon"), "displaced"), 0);
}

TEST(VelocityControl, LeadsABodyThroughTheAirAndLetsItSleep) {
  WorldBuilder builder(settings_of());
  add_box(builder, "kite", {1, 0.5, 0.2}, {0.1, 0.2, 3}, Motion::kDynamic, 2)
      .programs.push_back(example_program("velocity_control"));
  Watched world(builder, 2);
  world.step({told_all(world.world(), "kite", {{"x", 1}, {"z", 0.5}, {"turn_z", EIGEN_PI / 4}})});
  world.run(1);
  EXPECT_NEAR(world.velocity("kite").z(), 0.5, 1e-4);
  EXPECT_NEAR(world.velocity("kite").head<2>().norm(), 1, 1e-4);
  world.run(3);
  EXPECT_NEAR(world.body("kite").state.angular_velocity[2], EIGEN_PI / 4, 1e-3);
  world.step({told_all(world.world(), "kite", {{"x", 0}, {"z", 0}, {"turn_z", 0}})});
  world.run(5);
  EXPECT_EQ(world.body("kite").state.activity, Activity::kAsleep);
  const double height = world.position("kite").z();
  world.tell("kite", "z", -0.5);
  world.run(1);
  EXPECT_NEAR(world.position("kite").z(), height - 0.5, 0.02);
}

TEST(VelocityControl, KeepsItsAcceleration) {
  WorldBuilder builder(settings_of());
  builder.add_floor(50, 0);
  add_box(builder, "cart", {1, 0.5, 0.2}, {0.1, 0.2, 0.1}, Motion::kDynamic, 2)
      .programs.push_back(example_program("velocity_control", {{"planar", 1}, {"acceleration", 1}}));
  Watched world(builder);
  world.run(0.5);
  world.tell("cart", "y", -2);
  world.run(1);
  EXPECT_NEAR(world.velocity("cart").y(), -1, 0.05);
  world.run(2);
  EXPECT_NEAR(world.velocity("cart").y(), -2, 0.01);
  EXPECT_NEAR(world.position("cart").z(), 0.1, 1e-3);
}

TEST(Multicopter, HoversAndKeepsItsBounds) {
  WorldBuilder builder(settings_of());
  BodyDescription& drone = add_box(builder, "drone", {0.4, 0.4, 0.1}, {0.1, 0.2, 5}, Motion::kDynamic, 1.5);
  drone.programs.push_back(
      example_program("multicopter", {{"thrust", 30}, {"torque", 1}, {"lean", 0.3}, {"acceleration", 100}}));
  Watched world(builder, 2);
  world.run(4);
  EXPECT_NEAR(world.velocity("drone").norm(), 0, 0.01);
  EXPECT_NEAR(world.position("drone").z(), 5, 0.1) << "it falls for a tick, and has no place to keep";
  EXPECT_NEAR(value_of(world.body("drone"), "thrust"), 1.5 * kG, 0.05);
  world.tell("drone", "x", 20);
  double most_lean = 0;
  for (int tick = 0; tick < 180; ++tick) {
    world.step();
    most_lean = std::max(most_lean, value_of(world.body("drone"), "lean"));
    EXPECT_LE(value_of(world.body("drone"), "thrust"), 30);
  }
  EXPECT_NEAR(most_lean, 0.3, 0.03);
  // g tan(lean) is what leaning gives.
  EXPECT_NEAR(world.velocity("drone").x(), kG * std::tan(0.3) * 3, 0.1 * kG * std::tan(0.3) * 3);
  world.tell("drone", "on", 0);
  const double before = world.velocity("drone").z();
  world.run(0.5);
  EXPECT_NEAR(world.velocity("drone").z() - before, -kG * 0.5, 2 * kG * kDt);
}

// What its rotors could do is no matter.
TEST(Multicopter, StrongRotorsHoverToo) {
  WorldBuilder builder(settings_of());
  add_box(builder, "drone", {0.4, 0.4, 0.1}, {0.1, 0.2, 5}, Motion::kDynamic, 1.5)
      .programs.push_back(example_program("multicopter", {{"thrust", 2000}, {"torque", 200}, {"x", 1}}));
  Watched world(builder);
  world.run(5);
  EXPECT_NEAR(world.velocity("drone").x(), 1, 0.02);
  EXPECT_NEAR(world.velocity("drone").z(), 0, 0.01);
}

TEST(Wind, CarriesWhatIsLightAndLeavesNothingTurnedRound) {
  WorldBuilder builder(in_water());
  add_box(builder, "leaf", {1, 1, 1}, {0.1, 0.2, 0}, Motion::kDynamic, 1)
      .programs.push_back(example_program("wind", {{"drag", 1e4}, {"damping", 1e4}, {"x", 10}}));
  Watched world(builder);
  for (int tick = 0; tick < 60; ++tick) {
    world.step();
    EXPECT_LE(world.velocity("leaf").x(), 10 + 1e-4);
  }
  EXPECT_NEAR(world.velocity("leaf").x(), 10, 1e-2);
}

TEST(Programs, OfFluidsAreTheSameOnAnyPartitions) {
  WorldBuilder builder(settings_of(8));
  builder.add_floor(50, -3);
  for (int n = 0; n < 6; ++n) {
    const std::string number = std::to_string(n);
    const Eigen::Vector3d place(-12 + 5 * n, 0.3, 0);
    BodyDescription& pod = add_box(builder, "pod" + number, {0.5, 0.5, 0.5}, place, Motion::kDynamic, 100);
    pod.programs.push_back(example_program("floater", {{"z", 0.05}, {"wave", 0.4}}));
    pod.programs.push_back(
        example_program("hydrodynamics", {{"mass_x", 20}, {"drag_x", 10}, {"current_x", 1.5}}));
    BodyDescription& drone = add_box(builder, "drone" + number, {0.4, 0.4, 0.1},
                                     place + Eigen::Vector3d(0, 2, 2), Motion::kDynamic, 1.5);
    drone.programs.push_back(example_program("multicopter", {{"x", 3}, {"turn", 0.2 * n}}));
    drone.programs.push_back(example_program("wind", {{"damping", 0.2}, {"y", 2}}));
    add_box(builder, "slab" + number, {0.6, 0.4, 0.2}, place + Eigen::Vector3d(0, 4, -2.9), Motion::kDynamic)
        .programs.push_back(
            example_program("velocity_control", {{"planar", 1}, {"x", 2}, {"turn_z", 0.1 * n}}));
  }
  const auto alone = cluster_of(builder.world(), 1);
  expect_the_same_on_any_partitions(builder.world(), hashes_of(*alone, 150));
}

}  // namespace
}  // namespace tessera
