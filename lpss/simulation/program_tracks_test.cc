// Tracks against what mechanics says.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "lpss/simulation/program_scenes.h"

namespace tessera {
namespace {

// A box of 2,000 kg on two rows of wheels, 3 m long and 2 m apart.
BodyDescription& add_tank(WorldBuilder& builder, const std::string& name, const Eigen::Vector3d& position,
                          const ProgramNumbers& numbers) {
  BodyDescription& tank = add_box(builder, name, {4, 1.6, 0.4}, position, Motion::kDynamic, 2000);
  tank.programs.push_back(example_program("tracks", numbers));
  return tank;
}

TEST(Tracks, GoStraightAtTheirSpeed) {
  WorldBuilder builder(settings_of(64));
  builder.add_floor(400, 0);
  add_tank(builder, "tank", {0, 0, 0.5}, {{"force", 3000}, {"speed", 8}});
  Watched world(builder);
  world.run(1);
  world.tell("tank", "throttle", 0.5);
  world.run(1);
  EXPECT_NEAR(world.velocity("tank").x(), 2 * 3000.0 / 2000, 0.06) << "by the force of both sides";
  world.run(4);
  EXPECT_NEAR(world.velocity("tank").x(), 4, 1e-3);
  EXPECT_NEAR(world.position("tank").y(), 0, 1e-2);
  EXPECT_EQ(value_of(world.body("tank"), "wheels_on_ground"), 8);
  world.tell("tank", "throttle", 0);
  world.run(4);
  EXPECT_NEAR(world.velocity("tank").norm(), 0, 1e-4);
}

// Where wheels at x slide over the ground while it turns at a rate w, all bear alike, and friction is against
// their slip, (v - w b, w x), its moment is 0: sum((v - w b) b - w x^2) / |slip| = 0, b half of the width.
double skid_rate(double speed, double width, double length, int wheels) {
  const double b = width / 2;
  const auto moment = [&](double rate) {
    double sum = 0;
    for (int n = 0; n < wheels; ++n) {
      const double x = length * (n / (wheels - 1.0) - 0.5);
      sum += ((speed - rate * b) * b - rate * x * x) / std::hypot(speed - rate * b, rate * x);
    }
    return sum;
  };
  double low = 0;
  double high = speed / b * (1 - 1e-9);
  for (int n = 0; n < 60; ++n) (moment((low + high) / 2) > 0 ? low : high) = (low + high) / 2;
  return low;
}

TEST(Tracks, TurnOnTheSpotAsFrictionAllows) {
  // Two wheels a side: v b / (b^2 + a^2), with a half of the length.
  EXPECT_NEAR(skid_rate(2, 2, 3, 2), 2 / (1 + 1.5 * 1.5), 1e-9);
  for (const int wheels : {2, 4, 6}) {
    SCOPED_TRACE(wheels);
    WorldBuilder builder(settings_of(64));
    builder.add_floor(400, 0);
    add_tank(builder, "tank", {0, 0, 0.5},
             {{"force", 1e6}, {"speed", 4}, {"wheels", wheels}, {"stiffness", 2.4e5 / (2 * wheels)}});
    Watched world(builder);
    world.run(1);
    world.tell("tank", "turn", 0.5);
    world.run(6);
    const double expected = skid_rate(2, 2, 3, wheels);
    EXPECT_NEAR(world.body("tank").state.angular_velocity[2], expected, 0.02 * expected);
    EXPECT_NEAR(world.position("tank").head<2>().norm(), 0, 0.05);
  }
}

BodyDescription& add_tank_on_slope(WorldBuilder& builder, double angle, const ProgramNumbers& numbers) {
  add_slope(builder, angle);
  BodyDescription& tank = add_tank(builder, "tank", {0, 0, 0}, numbers);
  tank.pose.orientation = Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitY());
  tank.pose.position.local = tank.pose.orientation * Eigen::Vector3d(-8, 1, 0.5);
  return tank;
}

TEST(Tracks, ClimbASlope) {
  const double angle = 25 * M_PI / 180;
  WorldBuilder builder(settings_of(64));
  add_tank_on_slope(builder, angle, {{"force", 6000}, {"grip", 1}});
  Watched world(builder);
  world.run(2);
  world.tell("tank", "throttle", 1);
  world.run(0.5);
  const double speed = world.velocity("tank").norm();
  world.run(1);
  const double expected = 2 * 6000.0 / 2000 - kG * std::sin(angle);
  EXPECT_GT(world.velocity("tank").x(), 0);
  EXPECT_NEAR(world.velocity("tank").norm() - speed, expected, 0.05);
}

TEST(Tracks, StandOnASlopeWithinTheirGrip) {
  const double angle = 25 * M_PI / 180;
  for (const double grip : {0.6, 0.4}) {
    SCOPED_TRACE(grip);
    WorldBuilder builder(settings_of(64));
    builder.world().settings.sleep_after = 0;  // never
    add_tank_on_slope(builder, angle, {{"force", 1e5}, {"grip", grip}});
    Watched world(builder);
    world.run(2);
    const Eigen::Vector3d position = world.position("tank");
    const double speed = world.velocity("tank").norm();
    if (grip > std::tan(angle)) {
      world.run(20);
      EXPECT_NEAR((world.position("tank") - position).norm(), 0, 1e-3);
    } else {
      world.run(0.5);
      const double expected = kG * (std::sin(angle) - grip * std::cos(angle));
      EXPECT_NEAR((world.velocity("tank").norm() - speed) / 0.5, expected, 0.01 * kG);
    }
  }
}

// A vehicle whose tracks are bodies of this length.
void add_treads(WorldBuilder& builder, const std::string& name, const Eigen::Vector3d& place,
                const ProgramNumbers& inputs, double length = 0.4) {
  const auto first = static_cast<double>(builder.world().bodies.size() + 1);
  ProgramNumbers numbers = {{"left", first + 1}, {"right", first + 2}, {"separation", 0.8}};
  numbers.insert(numbers.end(), inputs.begin(), inputs.end());
  add_box(builder, name, {1, 0.5, 0.2}, place + Eigen::Vector3d(0, 0, 0.3), Motion::kDynamic, 20)
      .programs.push_back(example_program("treads", numbers));
  for (const auto& [side, y] : {std::pair{"_left", 0.4}, std::pair{"_right", -0.4}}) {
    const Eigen::Vector3d at = place + Eigen::Vector3d(0, y, 0.15);
    add_box(builder, name + side, {length, 0.1, 0.3}, at, Motion::kDynamic, 5).properties.friction = 0.8;
    builder.tie(name + side + "_mount", JointType::kFixed, name, name + side, at);
  }
}

TEST(Treads, GoTurnAndStandStill) {
  WorldBuilder builder(settings_of());
  builder.add_floor(50, 0);
  builder.world().bodies.back().properties.friction = 0.8;
  add_treads(builder, "robot", {0.1, 0.2, 0}, {});
  Watched world(builder, 2);
  world.run(0.5);
  world.tell("robot", "speed", 1);
  world.run(3);
  EXPECT_NEAR(world.velocity("robot").x(), 1, 0.01);
  world.step({told_all(world.world(), "robot", {{"speed", 0}, {"turn", 0.8}})});
  world.run(4);
  EXPECT_GT(world.body("robot").state.angular_velocity[2], 0.3) << "it turns to the left, and slips";
  EXPECT_NEAR(world.velocity("robot").norm(), 0, 0.05);
  world.step({told_all(world.world(), "robot", {{"speed", 0}, {"turn", 0}})});
  world.run(4);
  EXPECT_EQ(world.body("robot").state.activity, Activity::kAsleep);
}

// Long tracks slip as they turn. In steady state their friction is balanced: with a mean distance R of their
// corners from their middle, and s from track to track, the vehicle turns by u / (s / 2 + 2 R^2 / s) for
// track speeds of -u and u.
TEST(Treads, ThatAreLongSlipAsTheyTurn) {
  WorldBuilder builder(settings_of());
  builder.add_floor(50, 0);
  builder.world().bodies.back().properties.friction = 0.8;
  const double length = 1;
  add_treads(builder, "robot", {0.1, 0.2, 0}, {{"turn", 0.5}, {"efficiency", 1}}, length);
  Watched world(builder, 2);
  world.run(4);
  const double radius = std::hypot(length, 0.1) / 2;
  const double track_speed = 0.5 * 0.8 / 2;
  EXPECT_NEAR(world.body("robot").state.angular_velocity[2], track_speed / (0.4 + 2 * radius * radius / 0.8),
              0.01);
  EXPECT_NEAR(world.velocity("robot").norm(), 0, 0.01);
}

TEST(Treads, ThatAreLongMakeUpForTheirSlip) {
  WorldBuilder builder(settings_of());
  builder.add_floor(50, 0);
  builder.world().bodies.back().properties.friction = 0.8;
  add_treads(builder, "robot", {0.1, 0.2, 0}, {{"turn", 0.5}, {"correction", 2}}, 1);
  Watched world(builder, 2);
  world.run(4);
  EXPECT_NEAR(world.body("robot").state.angular_velocity[2], 0.5, 0.01);
  EXPECT_NEAR(world.velocity("robot").norm(), 0, 0.01);
  world.step({told_all(world.world(), "robot", {{"speed", 0.6}, {"turn", 0.4}})});
  world.run(4);
  EXPECT_NEAR(world.body("robot").state.angular_velocity[2], 0.4, 0.01);
  EXPECT_NEAR(world.velocity("robot").norm(), 0.6, 0.01);
  world.step({told_all(world.world(), "robot", {{"speed", 0}, {"turn", 0}})});
  world.run(4);
  EXPECT_EQ(world.body("robot").state.activity, Activity::kAsleep);
}

TEST(Belt, CarriesAndStops) {
  WorldBuilder builder(settings_of());
  add_box(builder, "belt", {12, 2, 1}, {-2, 0, -0.5}, Motion::kKinematic)
      .programs.push_back(example_program("belt", {{"turn", EIGEN_PI}}));
  add_box(builder, "crate", {0.5, 0.5, 0.5}, {0.1, 0.2, 0.25}, Motion::kDynamic);
  Watched world(builder, 2);
  world.run(3);
  EXPECT_EQ(world.body("crate").state.activity, Activity::kAsleep);
  world.tell("belt", "speed", 1);
  world.run(2.5);
  EXPECT_NEAR(world.velocity("crate").x(), -1, 0.01) << "it wakes, and speeds up by 1 m/s^2";
  world.tell("belt", "speed", 0);
  world.run(4);
  EXPECT_EQ(world.body("crate").state.activity, Activity::kAsleep);
  EXPECT_NEAR(world.position("crate").x(), 0.1 - 0.5 - 1.5 - 0.5, 0.1);
}

TEST(Programs, OfSurfacesAreTheSameOnAnyPartitions) {
  WorldBuilder builder(settings_of(8));
  builder.add_floor(50, 0);
  for (int n = 0; n < 4; ++n) {
    const std::string number = std::to_string(n);
    const double x = -11 + 6.5 * n;
    add_treads(builder, "robot" + number, {x, 0.3, 0}, {{"speed", 1 + 0.1 * n}, {"turn", 0.3 * n - 0.4}});
    add_box(builder, "belt" + number, {6, 2, 0.5}, {x, 5, 0.25}, Motion::kKinematic)
        .programs.push_back(example_program("belt", {{"speed", 1.5}, {"round", n % 2}}));
    add_box(builder, "crate" + number, {0.5, 0.5, 0.5}, {x, 5, 0.75}, Motion::kDynamic);
  }
  const auto alone = cluster_of(builder.world(), 1);
  expect_the_same_on_any_partitions(builder.world(), hashes_of(*alone, 200));
}

}  // namespace
}  // namespace tessera
