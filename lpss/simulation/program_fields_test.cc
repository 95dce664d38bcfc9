// Fields against what mechanics says.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "lpss/simulation/program_scenes.h"

namespace tessera {
namespace {

// A kinematic zone with a field.
BodyDescription& add_field(WorldBuilder& builder, const Geometry& geometry, const Eigen::Vector3d& position,
                           const ProgramNumbers& numbers, const std::string& name = "zone") {
  BodyDescription& zone = builder.add(name, builder.shape(geometry), 1, position, Motion::kKinematic);
  zone.properties.trigger = true;
  zone.programs.push_back(example_program("field", numbers));
  return zone;
}

BodyDescription& add_ball(WorldBuilder& builder, const std::string& name, const Eigen::Vector3d& position,
                          double mass = 1, double radius = 0.1) {
  BodyDescription& ball = builder.add(name, builder.shape(Sphere{radius}), mass, position);
  ball.properties.restitution = 0;
  return ball;
}

TEST(Field, BallsFallAsFastAsDragAllows) {
  for (const bool is_quadratic : {true, false}) {
    SCOPED_TRACE(is_quadratic);
    WorldBuilder builder(settings_of(128));
    add_field(builder, Box{{8, 8, 100}}, {0, 0, -40},
              {{is_quadratic ? "drag" : "damping", is_quadratic ? 0.5 : 2}});
    add_ball(builder, "light", {1, 1, 0}, 0.1);
    add_ball(builder, "heavy", {-1, 1, 0}, 50);
    Watched world(builder, 2);
    const double most = is_quadratic ? std::sqrt(kG / 0.5) : kG / 2;
    world.run(0.5);
    const double expected =
        is_quadratic ? most * std::tanh(kG * 0.5 / most) : most * (1 - std::exp(-2 * 0.5));
    EXPECT_NEAR(-world.velocity("light").z(), expected, 0.04 * expected);
    world.run(7.5);
    for (const char* ball : {"light", "heavy"}) {
      EXPECT_NEAR(-world.velocity(ball).z(), most, 1e-4 * most) << ball;
      EXPECT_NEAR(std::hypot(world.velocity(ball).x(), world.velocity(ball).y()), 0, 1e-6);
    }
  }
}

TEST(Field, WindTakesBallsAlong) {
  WorldBuilder builder(settings_of(64));
  add_field(builder, Box{{40, 8, 8}}, {0, 14, 0}, {{"wind_x", 3}, {"damping", 1}, {"z", kG}})
      .pose.orientation = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ());
  add_ball(builder, "ball", {1, 1, 0});
  Watched world(builder);
  world.run(2);
  EXPECT_NEAR(world.velocity("ball").y(), 3 * (1 - std::exp(-2)), 0.05) << "along the axes of the body";
  EXPECT_NEAR(world.velocity("ball").x(), 0, 1e-5);
  EXPECT_NEAR(world.velocity("ball").z(), -kG * kDt * std::exp(-2), 0.01) << "of the first tick";
}

TEST(Field, BallsFloatWhereItBearsTheirWeight) {
  WorldBuilder builder(settings_of());
  builder.add_floor(50, -4);
  add_field(builder, Box{{6, 6, 6}}, {8, 0, 0}, {{"z", kG}, {"damping", 1}});
  add_ball(builder, "light", {9, 1, 0.5}, 0.1);
  add_ball(builder, "heavy", {7, 1, 0.5}, 100);
  Watched world(builder, 2);
  world.run(20);
  EXPECT_EQ(value_of(world.body("zone"), "inside"), 2);
  EXPECT_EQ(value_of(world.body("zone"), "left_out"), 0);
  // They fall for one tick before it holds them, and lose that speed.
  for (const char* ball : {"light", "heavy"}) {
    EXPECT_NEAR(world.position(ball).z(), 0.5 - kG * kDt, 2 * kG * kDt * kDt) << ball;
    EXPECT_NEAR(world.velocity(ball).norm(), 0, 1e-4);
  }
}

// Over the borders of sectors.
TEST(Field, HoldsACircularOrbit) {
  WorldBuilder builder(settings_of(8));
  builder.world().settings.gravity = UniformGravity{{0, 0, 0}};
  const Eigen::Vector3d centre(4, 4, 0);
  add_field(builder, Sphere{3.9}, centre, {{"radial", -9}, {"near", 1}, {"power", 2}});
  const double speed = std::sqrt(9.0 / 3);
  const Eigen::Vector3d start = centre + Eigen::Vector3d(3, 0, 0);
  add_ball(builder, "moon", start).linear_velocity = {0, speed, 0};
  Watched world(builder, 3);
  const double period = 2 * M_PI * 3 / speed;
  double least = 3;
  double most = 3;
  for (int tick = 0; tick < std::lround(period / kDt); ++tick) {
    world.step();
    least = std::min(least, (world.position("moon") - centre).norm());
    most = std::max(most, (world.position("moon") - centre).norm());
  }
  EXPECT_NEAR(least, 3, 0.06);
  EXPECT_NEAR(most, 3, 0.06);
  EXPECT_NEAR((world.position("moon") - start).norm(), 0, 0.15);
}

TEST(Field, BallsSwingThroughItsCentre) {
  WorldBuilder builder(settings_of(32));
  builder.world().settings.gravity = UniformGravity{{0, 0, 0}};
  add_field(builder, Sphere{5}, {0, 0, 0}, {{"radial", -8}, {"near", 4}});
  add_ball(builder, "ball", {3, 0, 0});
  Watched world(builder);
  const double period = 2 * M_PI * std::sqrt(4.0 / 8);
  std::vector<double> crossed;
  double before = world.position("ball").x();
  for (int tick = 1; tick < 1000; ++tick) {
    world.step();
    const double now = world.position("ball").x();
    if (before < 0 && now >= 0) crossed.push_back((tick - now / (now - before)) * kDt);
    before = now;
  }
  ASSERT_GE(crossed.size(), 3u);
  EXPECT_NEAR((crossed.back() - crossed.front()) / static_cast<double>(crossed.size() - 1), period,
              1e-3 * period);
}

// A ball of 5 kg in the middle of a zone of its own.
BodyDescription& add_magnet(WorldBuilder& builder, const Eigen::Vector3d& position, double reach,
                            const ProgramNumbers& numbers) {
  const ShapeId shape = builder.shape(Sphere{0.3});
  Shape& both = builder.world().shapes.at(shape);
  ShapePart& zone = both.parts.emplace_back(ShapePart{Sphere{reach}, {}});
  zone.material.emplace().trigger = true;
  BodyDescription& magnet = builder.add("magnet", shape, 5, position);
  magnet.programs.push_back(example_program("field", numbers));
  return magnet;
}

TEST(Field, AMagnetBearsWhatItPullsWith) {
  WorldBuilder builder(settings_of(10));
  builder.world().settings.gravity = UniformGravity{{0, 0, 0}};
  add_magnet(builder, {5.5, 5, 5}, 5, {{"radial", -2}, {"near", 1}, {"power", 1}});
  add_ball(builder, "a", {8, 5, 5}, 2).linear_velocity = {0, 1, 0};
  add_ball(builder, "b", {3, 6, 6}, 3).linear_velocity = {0, 0, -0.5};
  Watched world(builder, 3);
  const auto sums = [&] {
    Eigen::Vector3d momentum = Eigen::Vector3d::Zero();
    Eigen::Vector3d angular = Eigen::Vector3d::Zero();
    for (const auto& [name, mass] : {std::pair{"magnet", 5.0}, std::pair{"a", 2.0}, std::pair{"b", 3.0}}) {
      momentum += mass * world.velocity(name);
      angular += world.position(name).cross(mass * world.velocity(name));
    }
    return std::pair(momentum, angular);
  };
  const auto before = sums();
  for (int tick = 0; tick < 120; ++tick) world.step();
  const auto after = sums();
  EXPECT_GT(world.velocity("magnet").norm(), 0.1);
  EXPECT_NEAR((after.first - before.first).norm(), 0, 1e-4);
  EXPECT_NEAR((after.second - before.second).norm(), 0, 1e-3);
}

TEST(Field, WakesWhatSleepsInIt) {
  WorldBuilder builder(settings_of(8));
  builder.world().settings.sleep_after = 0.2;
  builder.add_floor(50, 0);
  add_field(builder, Box{{4, 4, 4}}, {4, 0, 2}, {{"z", 2 * kG}, {"strength", 0}});
  add_ball(builder, "ball", {5, 1, 0.1});
  Watched world(builder, 2);
  for (Rank rank = 0; rank < 2; ++rank) world.cluster().partition(rank).pack_after = 2;
  world.run(4);
  ASSERT_TRUE(world.cluster().partition(0).at_rest);
  world.tell("zone", "strength", 1);
  EXPECT_EQ(value_of(world.body("zone"), "inside"), 1);
  world.run(0.5);
  EXPECT_NEAR(world.velocity("ball").z(), kG * 0.5, 0.02 * kG);
  // It keeps what floats awake, which falls as soon as it is off.
  world.tell("zone", "strength", 0.5);
  world.run(0.5);
  world.tell("zone", "strength", 0);
  world.run(3);
  EXPECT_NEAR(world.position("ball").z(), 0.1, 1e-2);
}

TEST(Field, LeavesOutTheFarthestOfTooMany) {
  WorldBuilder builder(settings_of(22));
  builder.world().settings.gravity = UniformGravity{{0, 0, 0}};
  add_field(builder, Box{{15, 15, 4}}, {11, 0, 0}, {{"z", 6}});
  const ShapeId ball = builder.shape(Sphere{0.1});
  int count = 0;
  for (int i = 0; i < 32; ++i) {
    for (int j = 0; j < 32; ++j)
      builder.add("ball" + std::to_string(count++), ball, 1, {11 + 0.45 * (i - 15.4), 0.45 * (j - 15.3), 0});
  }
  Watched world(builder, 2);
  // Pushed once, in the second tick.
  world.step();
  world.step();
  EXPECT_EQ(value_of(world.body("zone"), "inside"), 1000);
  EXPECT_EQ(value_of(world.body("zone"), "left_out"), 1);
  EXPECT_TRUE(world.body("zone").programs[0].fault.empty());
  int pushed = 0;
  double farthest = 0;  // of those that are pushed
  double nearest = 1e9;
  for (int n = 0; n < count; ++n) {
    const std::string name = "ball" + std::to_string(n);
    const Eigen::Vector3d position = world.position(name);
    const double away = std::hypot(position.x() - 11, position.y());
    if (world.velocity(name).z() > 0) {
      EXPECT_NEAR(world.velocity(name).z(), 6 * kDt, 1e-5);
      ++pushed;
      farthest = std::max(farthest, away);
    } else {
      EXPECT_EQ(world.velocity(name).z(), 0);
      nearest = std::min(nearest, away);
    }
  }
  EXPECT_EQ(pushed, 1000);
  EXPECT_LT(farthest, nearest);
}

// A zone of wind over the borders of many sectors, and a magnet that moves through it among balls.
WorldDescription field_world() {
  WorldBuilder builder(settings_of(8));
  builder.world().settings.gravity = UniformGravity{{0, 0, -1}};
  builder.add_floor(60, -3);
  const ProgramNumbers wind = {{"z", 0.8}, {"wind_x", 1}, {"damping", 0.3}, {"drag", 0.1}};
  add_field(builder, Box{{5, 5, 3}}, {3.3, 0.2, 0}, wind);
  add_field(builder, Box{{5, 5, 3}}, {-2.2, 3.8, 0}, wind, "zone2");
  add_magnet(builder, {-3, 0.3, 0.4}, 3.9, {{"radial", -3}, {"near", 1}, {"power", 1}}).linear_velocity = {
      2, 0, 0};
  for (int n = 0; n < 40; ++n) {
    add_ball(builder, "ball" + std::to_string(n), {1.3 * (n % 8) - 5, 1.1 * (n / 8) - 2.7, 0.31 * (n % 5)},
             0.2 + 0.1 * (n % 7));
  }
  return builder.world();
}

TEST(Field, IsTheSameOnAnyNumberOfPartitionsAndThreads) {
  const WorldDescription world = field_world();
  const auto alone = hashes_of(*cluster_of(world, 1), 300);
  expect_the_same_on_any_partitions(world, alone);
}

}  // namespace
}  // namespace tessera
