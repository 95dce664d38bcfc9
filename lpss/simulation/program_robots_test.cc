// Robots on wheels that joints hold, against how wheels roll.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "lpss/simulation/example_robots.h"
#include "lpss/simulation/program_scenes.h"

namespace tessera {
namespace {

WorldBuilder floor_world() {
  WorldBuilder builder(settings_of(4));
  builder.add_floor(30, 0);
  builder.world().bodies.back().properties.friction = 1;
  return builder;
}

double heading_of(const BodyRecord& body) {
  return std::atan2(body.state.rotation[3], body.state.rotation[0]);
}

// How far odometry is off: m, and rad, for a robot that started at the origin.
std::pair<double, double> off(Watched& world, const Eigen::Vector3d& middle) {
  const BodyRecord hull = world.body("robot");
  const Eigen::Vector3d true_place =
      world.position("robot") +
      quaternion_of(hull.state) * centre_frame(hull.properties).orientation.conjugate() * middle;
  const Eigen::Vector2d place(value_of(hull, "x") + middle.x(), value_of(hull, "y"));
  return {(true_place.head<2>() - place).norm(),
          std::abs(std::remainder(heading_of(hull) - value_of(hull, "heading"), 2 * EIGEN_PI))};
}

void expect_circle(Watched& world, Tread tread, const Eigen::Vector3d& middle, double radius, double speed,
                   double seconds) {
  const BodyRecord hull = world.body("robot");
  const double spin = hull.state.angular_velocity[2];
  // Of the middle between the driven wheels.
  const Eigen::Vector3d arm = quaternion_of(hull.state) * middle;
  const Eigen::Vector3d velocity =
      world.velocity("robot") + Eigen::Vector3d(hull.state.angular_velocity.data()).cross(arm);
  const double measured = velocity.head<2>().norm() / spin;
  const auto [place, angle] = off(world, middle);
  const double slip = tread == Tread::kBall ? 0.005 : 0.02;
  EXPECT_NEAR(measured / radius, 1, slip);
  EXPECT_NEAR(velocity.head<2>().norm() / speed, 1, slip);
  EXPECT_LT(place, slip * speed * seconds);
  EXPECT_LT(angle, slip * speed / std::abs(radius) * seconds);
}

TEST(DiffDrive, RollsInCirclesAndKnowsWhereItIs) {
  for (const Tread tread : {Tread::kBall, Tread::kCylinder}) {
    WorldBuilder builder = floor_world();
    add_robot(builder, "robot", tread, {0, 0, 0});
    Watched world(builder, 2);
    world.run(0.5);
    world.step({told_all(world.world(), "robot", {{"speed", 0.8}, {"turn", 0.8}})});
    world.run(10);
    expect_circle(world, tread, {0, 0, 0}, 1, 0.8, 10);
  }
}

TEST(DiffDrive, KeepsItsAccelerationsAndStandsStill) {
  WorldBuilder builder = floor_world();
  add_robot(builder, "robot", Tread::kCylinder, {0, 0, 0});
  Watched world(builder);
  world.run(0.5);
  world.tell("robot", "speed", 1.5);
  world.run(1);
  EXPECT_NEAR(world.velocity("robot").x(), 1, 0.03) << "1 m/s^2";
  world.run(2);
  EXPECT_NEAR(world.velocity("robot").x(), 1.5, 0.01);
  EXPECT_NEAR(world.velocity("robot").y(), 0, 0.01);
  world.tell("robot", "speed", 0);
  world.run(5);
  EXPECT_EQ(world.body("robot").state.activity, Activity::kAsleep);
  // Speeding up and braking take 1.5 s each, with 1 m/s^2.
  EXPECT_NEAR(world.position("robot").x(), 1.5 * (3 + 1 * kDt), 0.03);
  world.tell("robot", "turn", 1);
  world.run(4);
  EXPECT_NEAR(world.body("robot").state.angular_velocity[2], 1, 0.02);
}

TEST(Ackermann, SteersBothWheelsAboutOneMiddleAndRollsAroundIt) {
  for (const double steer : {0.3, -0.5}) {
    for (const Tread tread : {Tread::kBall, Tread::kCylinder}) {
      WorldBuilder builder = floor_world();
      add_rover(builder, "robot", tread, {0, 0, 0});
      Watched world(builder, 2);
      world.run(0.5);
      world.step({told_all(world.world(), "robot", {{"speed", 1}, {"steer", steer}})});
      world.run(10);
      const double radius = kExampleRover.wheelbase / std::tan(steer);
      const BodyRecord hull = world.body("robot");
      EXPECT_NEAR(value_of(hull, "left_angle"),
                  std::atan(kExampleRover.wheelbase / (radius - kExampleRover.track / 2)), 1e-12);
      EXPECT_NEAR(value_of(hull, "right_angle"),
                  std::atan(kExampleRover.wheelbase / (radius + kExampleRover.track / 2)), 1e-12);
      for (const std::string side : {"left", "right"}) {
        EXPECT_NEAR(std::remainder(heading_of(world.body("robot_" + side + "_knuckle")) - heading_of(hull),
                                   2 * EIGEN_PI),
                    value_of(hull, side + "_angle"), 2e-3)
            << side;
      }
      expect_circle(world, tread, {-kExampleRover.wheelbase / 2, 0, 0}, radius, 1, 10);
    }
  }
}

TEST(Ackermann, StopsAndSleeps) {
  WorldBuilder builder = floor_world();
  add_rover(builder, "robot", Tread::kCylinder, {0, 0, 0});
  Watched world(builder);
  world.step({told_all(world.world(), "robot", {{"speed", 1}, {"steer", 0.2}})});
  world.run(2);
  world.step({told_all(world.world(), "robot", {{"speed", 0}})});
  world.run(6);
  EXPECT_EQ(world.body("robot").state.activity, Activity::kAsleep);
}

TEST(Robots, DriveTheSameOnAnyNumberOfPartitionsAndThreads) {
  WorldBuilder builder = floor_world();
  add_robot(builder, "a", Tread::kCylinder, {0, 0.3, 0});
  add_robot(builder, "b", Tread::kBall, {1.5, 0.1, 0});
  add_rover(builder, "c", Tread::kCylinder, {-1.5, 0.2, 0});
  for (BodyDescription& body : builder.world().bodies) {
    if (body.programs.empty()) continue;
    ASSERT_TRUE(set_number(body.programs[0], "speed", body.name == "b" ? -1 : 1).ok());
    ASSERT_TRUE(set_number(body.programs[0], body.name == "c" ? "steer" : "turn", 0.3).ok());
  }
  const auto alone = hashes_of(*cluster_of(builder.world(), 1), 180);
  expect_the_same_on_any_partitions(builder.world(), alone);
}

}  // namespace
}  // namespace tessera
