// What diverges is stopped and named; the rest of the world goes on, with the same bits on any placement.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "lpss/engine/test_world.h"
#include "lpss/model/limits.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"

namespace tessera {
namespace {

using Script = std::function<std::vector<Command>(Tick)>;

struct Record {
  std::vector<WorldHash> hashes;  // after each tick
  std::vector<Divergence> events;
  std::uint64_t counted = 0;
};

Record run_with(const WorldDescription& world, std::uint32_t partitions, int ticks, const Script& script) {
  auto cluster = cluster_of(world, partitions);
  Record record;
  for (int t = 0; t < ticks; ++t) {
    cluster->step(script ? script(cluster->tick()) : std::vector<Command>());
    for (Rank rank = 0; rank < partitions; ++rank) check_invariants(cluster->partition(rank));
    record.hashes.push_back(cluster->hash());
    const std::vector<Divergence> events = cluster->divergences();
    record.events.insert(record.events.end(), events.begin(), events.end());
    record.counted += cluster->counts().diverged;
  }
  return record;
}

// Runs it on 1, 2 and 4 partitions, which end in the same, and returns what happened.
Record same_on_any_number(const WorldDescription& world, int ticks, const Script& script) {
  Record one = run_with(world, 1, ticks, script);
  for (const std::uint32_t partitions : {2u, 4u}) {
    const Record more = run_with(world, partitions, ticks, script);
    EXPECT_EQ(first_difference(one.hashes, more.hashes), one.hashes.size()) << partitions << " partitions";
    EXPECT_EQ(one.events, more.events) << partitions << " partitions";
  }
  EXPECT_EQ(one.counted, one.events.size());
  return one;
}

Record same_on_any_number(const WorldDescription& world, int ticks, const Command& command) {
  return same_on_any_number(world, ticks, [&](Tick tick) {
    return tick == 5 ? std::vector<Command>{command} : std::vector<Command>();
  });
}

// A tower on a floor across sectors, and beside it a chain of light links that hangs from the world.
WorldDescription tower_and_chain() {
  WorldSettings settings = sectors_of(2);
  settings.precision = engine_tests::test_precision;
  WorldBuilder builder(settings);
  builder.add_floor(20, 0);
  const ShapeId box = builder.shape(Box{{1, 1, 1}});
  for (int n = 0; n < 4; ++n) builder.add("box" + std::to_string(n), box, 10, {0.1 * n, 0.2, 0.5 + n});
  const ShapeId link = builder.shape(Box{{0.5, 0.02, 0.02}});
  std::string above;
  for (int n = 0; n < 4; ++n) {
    const std::string name = "link" + std::to_string(n);
    const double x = 8.3 + 0.5 * n;
    builder.add(name, link, 1e-3, {x + 0.25, 0.3, 6});
    builder.tie("hinge" + std::to_string(n), JointType::kRevolute, above, name, {x, 0.3, 6},
                Eigen::Vector3d::UnitY());
    above = name;
  }
  return builder.world();
}

constexpr std::uint64_t kTopBox = 5;     // ids: the floor, four boxes, four links
constexpr std::uint64_t kFirstLink = 6;  // of the chain

TEST(Divergence, TheLargestImpulseStopsOneBodyAndNoOther) {
  const WorldDescription world = tower_and_chain();
  const Record record = same_on_any_number(
      world, 60, ApplyImpulse{BodyId{kTopBox}, {kImpulseMax, kImpulseMax, 0}, {0, 0, kLeverMax}});
  ASSERT_EQ(record.events.size(), 1u);
  EXPECT_EQ(record.events[0].body, BodyId{kTopBox});
  EXPECT_EQ(record.events[0].tick, 6u);
  EXPECT_EQ(record.events[0].kind, DivergenceKind::kSpeed);
  EXPECT_EQ(record.events[0].joint, JointId{}) << "none holds it";
}

TEST(Divergence, TheLargestForceAndTorqueStopOneBodyAndNoOther) {
  ApplyForce push{BodyId{kTopBox}, {}};
  push.wrench = {{0, 0, -kForceMax}, {kTorqueMax, 0, 0}};
  const Record record = same_on_any_number(tower_and_chain(), 60, push);
  ASSERT_EQ(record.events.size(), 1u);
  EXPECT_EQ(record.events[0].body, BodyId{kTopBox});
}

// A drive far beyond what its links bear: they diverge, tick by tick, and the joint is named.
TEST(Divergence, ADriveTakesItsLinksAndNothingElse) {
  const WorldDescription world = tower_and_chain();
  const SetDrives drive{JointId{2}, {JointDrive{DriveMode::kEffort, kTorqueMax}, {}}};
  const Record record = same_on_any_number(world, 60, drive);
  ASSERT_FALSE(record.events.empty());
  EXPECT_EQ(record.events[0].tick, 6u);
  for (const Divergence& event : record.events) {
    EXPECT_GE(event.body.value, kFirstLink);
    EXPECT_GE(event.joint.value, 1u);
    EXPECT_LE(event.joint.value, 4u);
  }
  // The tower does what it does without a chain that diverges.
  auto still = cluster_of(world, 1);
  auto driven = cluster_of(world, 1);
  for (int t = 0; t < 60; ++t) {
    still->step();
    driven->step(t == 5 ? std::vector<Command>{drive} : std::vector<Command>());
  }
  for (std::uint64_t id = 2; id <= kTopBox; ++id) {
    EXPECT_EQ(still->body(BodyId{id})->state.position, driven->body(BodyId{id})->state.position);
    EXPECT_EQ(still->body(BodyId{id})->state.rotation, driven->body(BodyId{id})->state.rotation);
  }
}

// Forty-eight bodies, each joined to all others: more than a tick has time for.
TEST(Divergence, WhatHasTooManyJointsToBeSolvedIsStopped) {
  WorldSettings settings = sectors_of(8);
  settings.precision = engine_tests::test_precision;
  WorldBuilder builder(settings);
  const ShapeId ball = builder.shape(Sphere{0.1});
  builder.add("free", ball, 1, {0, 0, 0});
  constexpr int kKnot = 48;
  const auto name = [](int n) { return "knot" + std::to_string(n); };
  for (int n = 0; n < kKnot; ++n) {
    builder.add(name(n), ball, 1, {3 + 0.3 * n, 0, 0});
    for (int other = 0; other < n; ++other) {
      builder.tie(name(n) + "_" + std::to_string(other), JointType::kBall, name(other), name(n),
                  {3 + 0.15 * (n + other), 0, 0}, Eigen::Vector3d::UnitZ());
    }
  }
  const Record record = same_on_any_number(builder.world(), 3, Script());
  EXPECT_EQ(record.events.size(), 3u * kKnot) << "all of them, in each tick";
  for (const Divergence& event : record.events) EXPECT_GT(event.body, BodyId{1});
}

TEST(Divergence, ABodyGoesOnOnceTheCauseIsGone) {
  const WorldDescription world = tower_and_chain();
  const Record record = same_on_any_number(world, 120, [](Tick tick) {
    std::vector<Command> commands;
    if (tick == 5) commands = {SetDrives{JointId{2}, {JointDrive{DriveMode::kEffort, kTorqueMax}, {}}}};
    if (tick == 10) commands = {SetDrives{JointId{2}, {}}};
    return commands;
  });
  ASSERT_FALSE(record.events.empty());
  EXPECT_LE(record.events.back().tick, 11u);
  EXPECT_NE(record.hashes[119], record.hashes[60]) << "the chain swings";
}

// Thin links: their moments of inertia about their length are 1e-4 of those across.
TEST(Divergence, ThinLinksUnderLoadStayWhereTheyAreHeldOrAreNamed) {
  WorldSettings settings = sectors_of(2);
  settings.precision = engine_tests::test_precision;
  WorldBuilder builder(settings);
  const ShapeId rod = builder.shape(Box{{1, 0.008, 0.008}});
  const ShapeId load = builder.shape(Box{{0.5, 0.5, 0.5}});
  std::string above;
  for (int n = 0; n < 5; ++n) {
    const std::string name = "rod" + std::to_string(n);
    BodyDescription& link = builder.add(name, rod, 0.05, {0.5 + n, 0.3, 6});
    link.properties.inertia[0] = link.properties.inertia[1] * 1e-4;
    builder.tie("hinge" + std::to_string(n), n % 2 == 0 ? JointType::kUniversal : JointType::kRevolute, above,
                name, {1.0 * n, 0.3, 6}, Eigen::Vector3d::UnitY());
    above = name;
  }
  builder.add("load", load, 500, {5.25, 0.3, 6}).angular_velocity = {30, 0, 0};
  builder.tie("grip", JointType::kFixed, above, "load", {5, 0.3, 6});
  const Record record = same_on_any_number(builder.world(), 240, Script());
  for (const Divergence& event : record.events) EXPECT_NE(event.joint, JointId{});
}

// The baseline's worlds and solver.
TEST(Divergence, ThePolicyCloneStopsBodiesToo) {
  WorldDescription world = tower_and_chain();
  world.settings.seams = SeamPolicy::kClone;
  const Record record = run_with(world, 2, 60, [](Tick tick) {
    std::vector<Command> commands;
    if (tick == 5) {
      commands = {ApplyImpulse{BodyId{kTopBox}, {kImpulseMax, 0, 0}, {0, 0, kLeverMax}},
                  SetDrives{JointId{2}, {JointDrive{DriveMode::kEffort, kTorqueMax}, {}}}};
    }
    return commands;
  });
  ASSERT_FALSE(record.events.empty());
  EXPECT_EQ(record.events[0].body, BodyId{kTopBox});
  EXPECT_EQ(record.counted, record.events.size());
}

}  // namespace
}  // namespace tessera
