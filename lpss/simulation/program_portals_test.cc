// Portals: where bodies come to, how fast, and how often.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "lpss/simulation/program_scenes.h"

namespace tessera {
namespace {

using Eigen::Vector3d;

// A kinematic zone of 2 m with a portal.
BodyDescription& add_portal(WorldBuilder& builder, const Vector3d& position, const ProgramNumbers& numbers,
                            const std::string& name = "portal") {
  BodyDescription& zone = builder.add(name, builder.shape(Box{{2, 2, 2}}), 1, position, Motion::kKinematic);
  zone.properties.trigger = true;
  zone.programs.push_back(example_program("portal", numbers));
  return zone;
}

BodyDescription& add_marble(WorldBuilder& builder, const std::string& name, const Vector3d& position) {
  BodyDescription& ball = builder.add(name, builder.shape(Sphere{0.1}), 1, position);
  ball.properties.restitution = 0;
  return ball;
}

WorldBuilder without_weight(double sector_size = 16) {
  WorldBuilder builder(settings_of(sector_size));
  builder.world().settings.gravity = UniformGravity{{0, 0, 0}};
  return builder;
}

// It falls 9 m between the portals of a shaft, again and again.
TEST(Portal, WhatFallsForEverGainsTheEnergyOfEachFall) {
  WorldBuilder builder(settings_of());
  add_portal(builder, {0, 0, -5}, {{"z", 10}});
  add_marble(builder, "ball", {0.3, 0.2, 5});
  Watched world(builder, 2);
  double taken = 0;
  double before = 0;
  while (taken < 4) {
    const double speed = -world.velocity("ball").z();
    world.step();
    const double now = value_of(world.body("portal"), "taken");
    if (now > taken) {
      // In the air for its time: v = g t, whatever the portal does.
      EXPECT_NEAR(speed, before + kG * kDt, 1e-3);
      taken = now;
    }
    before = speed;
    EXPECT_GT(world.position("ball").z(), -6.5);
    EXPECT_LT(world.position("ball").z(), 6);
  }
  EXPECT_NEAR(world.position("ball").x(), 0.3, 1e-5) << "as it lay about the portal";
}

TEST(Portal, OneBodyInATimeLeavesAtTheExit) {
  WorldBuilder builder = without_weight(8);
  add_portal(builder, {0, 0, 0},
             {{"x", 30}, {"y", 1}, {"arrange", 0}, {"every", 0.5}, {"keep", 0}, {"vx", 2}});
  for (int n = 0; n < 5; ++n) add_marble(builder, "ball" + std::to_string(n), {0.25 * n - 0.5, 0.5, 0.5});
  Watched world(builder, 3);
  world.run(1.25);
  EXPECT_EQ(value_of(world.body("portal"), "taken"), 3);
  EXPECT_EQ(value_of(world.body("portal"), "waiting"), 2);
  // The nearest one, which left first, has gone on for a second or so.
  EXPECT_NEAR(world.position("ball2").x(), 30 + 2 * 1.25, 2.1 * kDt * 2);
  EXPECT_NEAR(world.position("ball2").y(), 1, 1e-6);
  EXPECT_NEAR(world.velocity("ball2").x(), 2, 1e-9);
  world.run(5);
  EXPECT_EQ(value_of(world.body("portal"), "taken"), 5);
  EXPECT_EQ(value_of(world.body("portal"), "waiting"), 0);
  std::vector<double> places;
  for (int n = 0; n < 5; ++n) places.push_back(world.position("ball" + std::to_string(n)).x());
  std::ranges::sort(places);
  for (std::size_t n = 1; n < places.size(); ++n) EXPECT_NEAR(places[n] - places[n - 1], 2 * 0.5, 1e-4);
}

TEST(Portal, WaitsUntilThereIsRoom) {
  WorldBuilder builder = without_weight();
  add_portal(builder, {0, 0, 0}, {{"x", 10}, {"arrange", 0}, {"room", 0.5}});
  add_marble(builder, "ball", {0.5, 0, 0});
  add_marble(builder, "guard", {10, 0, 0.3});
  Watched world(builder, 2);
  world.run(2);
  EXPECT_EQ(value_of(world.body("portal"), "taken"), 0);
  EXPECT_EQ(value_of(world.body("portal"), "waiting"), 1);
  world.step({SetVelocity{BodyId{3}, {0, 0, 4}, {}}});
  world.run(0.5);
  EXPECT_EQ(value_of(world.body("portal"), "taken"), 1);
  EXPECT_NEAR((world.position("ball") - Vector3d(10, 0, 0)).norm(), 0, 1e-6);
}

TEST(Portal, ClosedOrHeldByAJointNobodyPasses) {
  WorldBuilder builder = without_weight();
  add_portal(builder, {0, 0, 0}, {{"x", 10}}).programs[0].inputs = {0};
  add_marble(builder, "ball", {0.5, 0, 0});
  add_marble(builder, "held", {-0.5, 0, 0});
  add_marble(builder, "tail", {-3, 0, 0});
  builder.tie("bar", JointType::kFixed, "held", "tail", {-3, 0, 0});
  Watched world(builder, 2);
  world.run(1);
  EXPECT_EQ(value_of(world.body("portal"), "taken"), 0);
  world.tell("portal", "open", 1);
  world.run(1);
  EXPECT_EQ(value_of(world.body("portal"), "taken"), 1);
  EXPECT_EQ(value_of(world.body("portal"), "waiting"), 0);
  EXPECT_NEAR(world.position("ball").x(), 10.5, 1e-6);
  EXPECT_NEAR(world.position("held").x(), -0.5, 1e-6);
}

// A fountain: a drain on the ground, and a spout above it, in other sectors.
WorldBuilder fountain() {
  WorldBuilder builder(settings_of(6));
  for (int n = 0; n < 20; ++n)
    add_marble(builder, "ball" + std::to_string(n),
               {0.4 * (n % 4) - 0.6, 0.4 * (n / 4 % 4) - 0.7, 1 + n * 0.2});
  add_portal(
      builder, {0, 0, -7},
      {{"z", 12}, {"arrange", 0}, {"every", 0.1}, {"room", 0.15}, {"keep", 0}, {"vz", 4}, {"spread", 0.2}});
  builder.add_floor(50, -8);
  return builder;
}

TEST(Portal, AFountainHasTheSameBitsOnAnyPartitions) {
  const WorldDescription world = fountain().world();
  const auto cluster = cluster_of(world, 1);
  const auto alone = hashes_of(*cluster, 500);
  EXPECT_GT(value_of(*cluster->body(BodyId{21}), "taken"), 20);
  expect_the_same_on_any_partitions(world, alone);
}

}  // namespace
}  // namespace tessera
