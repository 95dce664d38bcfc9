// Joints that break, against what statics says.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <tuple>
#include <utility>

#include "lpss/simulation/program_scenes.h"

namespace tessera {
namespace {

bool has_joint(Watched& world, std::uint64_t joint) {
  for (Rank rank = 0; rank < world.cluster().size(); ++rank) {
    if (world.cluster().partition(rank).joints.find(JointId{joint}) != nullptr) return true;
  }
  return false;
}

// Pushes a body down, the harder the later.
SetForce load_of(const BodyRecord& body, double newtons) {
  return {body.id, LastingForce{{{0, 0, -newtons}, {}}}};
}

TEST(Breaker, AChainBreaksAtItsWeakestLinkWhenThatBearsTooMuch) {
  for (const std::uint32_t partitions : {1u, 4u}) {
    SCOPED_TRACE(partitions);
    constexpr double kMost = 60;   // N, of the third of five joints
    constexpr double kRate = 0.1;  // N a tick
    WorldBuilder builder(settings_of(1));
    builder.add_chain(5, {0.3, 0.2, 1.4}, -Eigen::Vector3d::UnitZ());
    for (int n = 0; n < 5; ++n) {
      builder.world().bodies[static_cast<std::size_t>(n)].programs = {
          example_program("breaker", {{"force", n == 2 ? kMost : 1000}})};
    }
    Watched world(builder, partitions);
    // It bears three links of 1 kg, and the load.
    const auto breaks = static_cast<int>(std::ceil((kMost - 3 * kG) / kRate));
    int tick = 0;
    while (has_joint(world, 3) && tick < 600) {
      ++tick;
      world.step({load_of(world.body("link4"), kRate * tick)});
    }
    EXPECT_NEAR(tick, breaks + 1, 1) << "it is gone in the tick after";
    EXPECT_EQ(value_of(world.body("link2"), "broken"), 1);
    EXPECT_NEAR(world.velocity("link4").norm(), (kG + kRate * tick / 3) * kDt, 0.1 * kG * kDt);
    world.step({SetForce{world.body("link4").id, std::nullopt}});
    const double before = world.velocity("link4").z();
    world.run(0.5);
    EXPECT_NEAR(world.velocity("link4").z() - before, -kG * 0.5, 0.02 * kG) << "it falls";
    EXPECT_NEAR(world.velocity("link1").norm(), 0, 0.02);
    for (const std::uint64_t joint : {1, 2, 4, 5}) EXPECT_TRUE(has_joint(world, joint)) << joint;
    EXPECT_NEAR(value_of(world.body("link0"), "force"), 2 * kG, 1);
    EXPECT_TRUE(validate(world.cluster().snapshot()).ok());
  }
}

TEST(Breaker, ReleasesAJointWhenItIsToldTo) {
  WorldBuilder builder(settings_of(1));
  builder.add_chain(4, {0.3, 0.2, 1.4}, -Eigen::Vector3d::UnitZ());
  builder.world().bodies[1].programs = {example_program("breaker", {{"joint", 3}})};  // that holds its child
  Watched world(builder, 4);
  world.run(2);
  for (const std::uint64_t joint : {1, 2, 3, 4}) EXPECT_TRUE(has_joint(world, joint)) << joint;
  world.tell("link1", "release", 1);
  world.run(0.1);
  EXPECT_FALSE(has_joint(world, 3));
  for (const std::uint64_t joint : {1, 2, 4}) EXPECT_TRUE(has_joint(world, joint)) << joint;
  EXPECT_EQ(value_of(world.body("link1"), "broken"), 1);
}

TEST(Breaker, ABeamBreaksAtItsRootWhereTheTorqueIsLargest) {
  constexpr double kMost = 60;    // N m
  constexpr double kRate = 0.05;  // N a tick
  WorldBuilder builder(settings_of(1));
  for (int n = 0; n < 4; ++n) {
    const std::string name = "part" + std::to_string(n);
    add_box(builder, name, {0.5, 0.1, 0.1}, {0.25 + 0.5 * n, 0.2, 0.2}, Motion::kDynamic);
    builder.tie("joint" + std::to_string(n), JointType::kFixed, n == 0 ? "" : "part" + std::to_string(n - 1),
                name, {0.5 * n, 0.2, 0.2});
    builder.world().bodies.back().programs = {example_program("breaker", {{"torque", kMost}})};
  }
  Watched world(builder, 3);
  const auto breaks = static_cast<int>(std::ceil((kMost - 4 * kG * 1) / 1.75 / kRate));
  int tick = 0;
  while (has_joint(world, 1) && tick < 600) {
    ++tick;
    world.step({load_of(world.body("part3"), kRate * tick)});
  }
  EXPECT_NEAR(tick, breaks + 1, 2);
  for (const std::uint64_t joint : {2, 3, 4}) EXPECT_TRUE(has_joint(world, joint)) << joint;
}

// Over a border, so that each server has a part of it.
TEST(Breaker, AStandingHookLosesWhatIsTooHeavy) {
  WorldBuilder builder(settings_of(4));
  add_box(builder, "hook", {2, 0.1, 0.1}, {2, 0.2, 1}, Motion::kKinematic).programs = {
      example_program("breaker", {{"force", 50}, {"children", 1}})};
  for (const auto& [name, x, mass] : {std::tuple("light", 1.1, 4.0), std::tuple("heavy", 2.9, 6.0)}) {
    add_box(builder, name, {0.2, 0.2, 0.2}, {x, 0.2, 0.5}, Motion::kDynamic, mass);
    builder.tie(std::string("of_") + name, JointType::kBall, "hook", name, {x, 0.2, 1});
  }
  Watched world(builder, 2);
  world.run(0.5);
  EXPECT_TRUE(has_joint(world, 1));
  EXPECT_FALSE(has_joint(world, 2));
  EXPECT_EQ(value_of(world.body("hook"), "broken"), 1);
  EXPECT_NEAR(value_of(world.body("hook"), "force"), 4 * kG, 0.1);
}

// Chains over the borders of sectors, whose links tear as they swing.
WorldDescription tearing_world() {
  WorldDescription world = chain_world(settings_of(2), 12, {0.3, 0.2, 0.4});
  for (std::size_t n = 0; n < world.bodies.size(); ++n) {
    if (world.bodies[n].properties.motion == Motion::kDynamic)
      world.bodies[n].programs = {example_program("breaker", {{"force", n % 4 == 1 ? 90 : 1e4}})};
  }
  return world;
}

TEST(Breaker, BreaksTheSameJointsOnAnyNumberOfPartitionsAndThreads) {
  const WorldDescription world = tearing_world();
  const auto one = cluster_of(world, 1);
  const std::size_t joints = one->partition(0).joints.size();
  const auto alone = hashes_of(*one, 240);
  EXPECT_LT(one->partition(0).joints.size(), joints);
  expect_the_same_on_any_partitions(world, alone);
}

}  // namespace
}  // namespace tessera
