// Bodies that go from place to place by themselves.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "lpss/simulation/program_scenes.h"

namespace tessera {
namespace {

// A puck that slides on the floor.
BodyDescription& add_puck(WorldBuilder& builder, const ProgramNumbers& numbers) {
  BodyDescription& puck =
      builder.add("puck", builder.shape(Cylinder{0.5, 0.2}), 5, {0.1, 0.2, 0.1}, Motion::kDynamic);
  puck.properties.friction = 0.4;
  puck.programs.push_back(example_program("waypoints", numbers));
  return puck;
}

const ProgramNumbers kSquare = {{"count", 4}, {"axes", 1}, {"torque", 12}, {"force", 25}, {"hold", 1},
                                {"x_0", 6},   {"x_1", 6},  {"y_1", 6},     {"y_2", 6}};

TEST(Waypoints, AreReachedOneAfterTheOther) {
  WorldBuilder builder(settings_of());
  builder.add_floor(50, 0);
  add_puck(builder, kSquare);
  Watched world(builder, 2);
  std::vector<Eigen::Vector2d> reached;
  double next = 0;
  for (int tick = 0; tick < 60 * 60 && reached.size() < 3; ++tick) {
    world.step();
    const double now = value_of(world.body("puck"), "next");
    if (now != next) reached.emplace_back(world.position("puck").head<2>());
    next = now;
  }
  ASSERT_EQ(reached.size(), 3u);
  EXPECT_NEAR((reached[0] - Eigen::Vector2d(6.1, 0.2)).norm(), 0.5, 0.1) << "at the edge of its range";
  EXPECT_NEAR((reached[1] - Eigen::Vector2d(6.1, 6.2)).norm(), 0.5, 0.1);
  EXPECT_NEAR((reached[2] - Eigen::Vector2d(0.1, 6.2)).norm(), 0.5, 0.1);
  world.run(30);
  EXPECT_LE((world.position("puck").head<2>() - Eigen::Vector2d(0.1, 0.2)).norm(), 0.5);
  EXPECT_EQ(value_of(world.body("puck"), "next"), 3);
  EXPECT_EQ(world.body("puck").state.activity, Activity::kAsleep) << "it rests at the last one";
}

TEST(Waypoints, GoRoundWhereTheyLoopAndWaitWhilePaused) {
  WorldBuilder builder(settings_of());
  builder.add_floor(50, 0);
  ProgramNumbers numbers = kSquare;
  numbers.emplace_back("loop", 1);
  add_puck(builder, numbers);
  Watched world(builder);
  double rounds = 0;
  double next = 0;
  for (int tick = 0; tick < 120 * 60 && rounds < 2; ++tick) {
    world.step();
    const double now = value_of(world.body("puck"), "next");
    if (now < next) ++rounds;
    next = now;
  }
  EXPECT_EQ(rounds, 2);
  world.tell("puck", "paused", 1);
  world.run(8);
  EXPECT_EQ(world.body("puck").state.activity, Activity::kAsleep);
  world.tell("puck", "paused", 0);
  world.run(1);
  EXPECT_GT(world.velocity("puck").norm() + std::abs(world.body("puck").state.angular_velocity[2]), 0.1);
}

// Of the body, whose heading is to the left at first: 4 m ahead are 4 m along y.
TEST(Waypoints, MayBeAlongTheFirstHeadingOrFromTheWorldsOrigin) {
  for (const double axes : {0.0, 2.0}) {
    WorldBuilder builder(settings_of());
    builder.add_floor(50, 0);
    ProgramNumbers numbers = {{"count", 1}, {"axes", axes}, {"torque", 12}, {"force", 25}, {"hold", 1}};
    if (axes == 2) {
      numbers.emplace_back("x_0", 4);
    } else {
      numbers.insert(numbers.end(), {{"from_x", 0.1}, {"from_y", 0.2}, {"x_0", 0.1}, {"y_0", 4.2}});
    }
    add_puck(builder, numbers).pose.orientation = Eigen::AngleAxisd(EIGEN_PI / 2, Eigen::Vector3d::UnitZ());
    Watched world(builder);
    world.run(10);
    EXPECT_LE((world.position("puck").head<2>() - Eigen::Vector2d(0.1, 4.2)).norm(), 0.5) << axes;
  }
}

TEST(Waypoints, HaveTheSameBitsOnAnyPartitions) {
  WorldBuilder builder(settings_of(4));
  builder.add_floor(50, 0);
  add_puck(builder, kSquare);
  const auto alone = cluster_of(builder.world(), 1);
  expect_the_same_on_any_partitions(builder.world(), hashes_of(*alone, 400));
}

}  // namespace
}  // namespace tessera
