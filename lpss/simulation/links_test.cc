// Servers that talk to those around them alone come to the bits of one process.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "lpss/simulation/example_mechanisms.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"

namespace tessera {
namespace {

// What a test changes about each partition before the first tick.
using Change = std::function<void(Partition&)>;
using CommandsAt = std::function<std::vector<Command>(Tick)>;

void change(PartitionCluster& cluster, const Change& what) {
  for (Rank rank = 0; rank < cluster.size(); ++rank) what(cluster.partition(rank));
}

void by_links(Partition& partition) { partition.all_linked_max = 1; }

// A world on one partition, and on as many as there are clusters, that must not differ.
void expect_same_bits(const WorldDescription& world, const std::vector<std::uint32_t>& partitions, Tick ticks,
                      const CommandsAt& commands_at = {}, const Change& also = {}) {
  std::vector<WorldHash> one;
  const auto one_process = cluster_of(world, 1);
  for (Tick tick = 1; tick <= ticks; ++tick) {
    one_process->step(commands_at ? commands_at(tick) : std::vector<Command>{});
    one.push_back(one_process->hash());
  }
  for (const std::uint32_t count : partitions) {
    const auto cluster = cluster_of(world, count);
    change(*cluster, by_links);
    if (also) change(*cluster, also);
    for (Tick tick = 1; tick <= ticks; ++tick) {
      cluster->step(commands_at ? commands_at(tick) : std::vector<Command>{});
      for (Rank rank = 0; rank < count; ++rank) check_invariants(cluster->partition(rank));
      ASSERT_EQ(cluster->hash(), one[tick - 1]) << count << " partitions, tick " << tick;
    }
  }
}

TEST(Links, APileOnAnyNumberOfServers) {
  expect_same_bits(pile_world(sectors_of(4), 150), {2, 3, 5, 9, 12, 70}, 200);
}

TEST(Links, PyramidsThatServersSolveInStep) {
  for (const double sector_size : {4.0, 1.75}) {
    WorldDescription world = pyramid_world(sectors_of(sector_size), 12);
    world.settings.sleep_after = 0;
    expect_same_bits(world, {3, 8, 12}, 60, {}, [](Partition& partition) { partition.in_step_from = 0; });
  }
}

TEST(Links, AuthorityThatMovesAtRandom) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    WorldDescription world = pile_world(sectors_of(3), 80);
    world.settings.shuffle = seed;
    expect_same_bits(world, {3, 6, 12}, 150);
  }
}

TEST(Links, UnderThePolicyClone) {
  expect_same_bits(pile_world(sectors_of(16, SeamPolicy::kClone), 100), {3, 9}, 100);
}

TEST(Links, CommandsThatReachFar) {
  const WorldDescription world = pile_world(sectors_of(8), 60);
  const BodyRecord some = records_of(world)->at(1);
  const std::int64_t far = std::int64_t{1} << 40;
  expect_same_bits(world, {3, 12}, 160, [&](Tick tick) -> std::vector<Command> {
    BodyRecord spawned = some;
    BodyState state;
    switch (tick) {
      case 10:
        spawned.id = BodyId{1000};
        spawned.state.position[2] += 6;
        return {SpawnBody{spawned}, ApplyImpulse{BodyId{1000}, {2, 1, 0}, {0.1, 0, 0}}};
      case 20:
        spawned.id = BodyId{1001};
        spawned.home = {far, -far, 3};
        return {SpawnBody{spawned}};
      case 30:
        return {RemoveBody{BodyId{7}}, SetVelocity{BodyId{9}, {300, 20, 4}, {0, 0, 1}}};
      case 40:  // two to the same place, where they meet
        state.position = {3.5, -3.9, 3};
        return {Teleport{BodyId{12}, {-far, 0, 7}, state}, Teleport{BodyId{13}, {-far, 0, 7}, state}};
      case 50:
        return {Teleport{BodyId{1001}, {0, 0, 0}, state}, SetVelocity{BodyId{20}, {-900, 10, 5}, {}}};
      case 80:
        return {RemoveBody{BodyId{1}}};  // the floor
      default:
        return {};
    }
  });
}

TEST(Links, FastBodiesThatCrossManyServersInATick) {
  WorldSettings settings = sectors_of(4);
  WorldBuilder builder(settings);
  builder.add_floor(60, 0);
  const ShapeId ball = builder.shape(Sphere{0.2});
  const ShapeId box = builder.shape(Box{{1, 1, 1}});
  for (int n = 0; n < 24; ++n)
    builder.add(absl::StrCat("box", n), box, 5, {4.0 * n - 46, 0.3 * (n % 3), 0.55});
  for (int n = 0; n < 8; ++n) {
    BodyDescription& shot = builder.add(absl::StrCat("shot", n), ball, 1, {-50.0 - n, 3.0 * n - 10, 0.6});
    shot.linear_velocity = {200.0 + 150 * n, 200.0 / (n + 1), 1};
    BodyDescription& other = builder.add(absl::StrCat("other", n), ball, 1, {50.0 + n, 2.0 * n - 8, 0.7});
    other.linear_velocity = {-150.0 - 120 * n, 10, 1};
  }
  expect_same_bits(builder.world(), {4, 12, 24}, 90);
}

// Boxes in a row that touch, and one that flies far away, so that the world is never at rest.
WorldDescription sleeping_row(double sector_size = 2.5) {
  WorldSettings settings = sectors_of(sector_size);
  settings.sleep_after = 0.2;
  WorldBuilder builder(settings);
  builder.add_floor(60, -0.5);
  const ShapeId box = builder.shape(Box{{1, 1, 1}});
  for (int n = 0; n < 50; ++n) builder.add(absl::StrCat("box", n), box, 1, {n - 25.0, 0.1, -0.001});
  BodyDescription& flies = builder.add("flies", box, 1, {0, 0, 400});
  flies.properties.gravity = false;
  flies.linear_velocity = {0, 0.5, 0};
  return builder.world();
}

std::vector<Command> push_at(Tick tick) {
  if (tick == 300) return {ApplyImpulse{BodyId{2}, {0, 3, 0}, {}}};
  if (tick == 420) return {ApplyImpulse{BodyId{30}, {0, 3, 2}, {}}};
  return {};
}

TEST(Links, AnIslandAtRestOverManyServersWakesAtOnce) {
  for (const std::uint64_t pack_after : {10, 1000}) {
    expect_same_bits(sleeping_row(), {3, 9, 16}, 460, push_at,
                     [&](Partition& partition) { partition.pack_after = pack_after; });
  }
}

TEST(Links, AServerIsLinkedToThoseAroundItAlone) {
  const auto cluster = cluster_of(sleeping_row(6), 9);
  change(*cluster, by_links);
  std::size_t most = 0;
  for (int tick = 0; tick < 20; ++tick) {
    cluster->step();
    for (Rank rank = 0; rank < cluster->size(); ++rank)
      most = std::max(most, cluster->machine(rank).links().size());
  }
  EXPECT_EQ(most, 2u);
  for (int tick = 0; tick < 200; ++tick) cluster->step();
  for (Rank rank = 0; rank < cluster->size(); ++rank)
    EXPECT_EQ(cluster->machine(rank).links().size(), 0u) << "all in its neighbourhood is at rest";
}

TEST(Links, AnIslandThatWakesTakesAsManyRoundsAsItIsLong) {
  constexpr std::uint32_t kServers = 9;
  const auto cluster = cluster_of(sleeping_row(), kServers);
  change(*cluster, by_links);
  std::size_t messages = 0;
  cluster->listen([&](Rank, Rank, const RoundMessage& message) {
    messages += std::holds_alternative<Agreement>(message) ? 1 : 0;
  });
  // An agreement is a message to each server but the root, and one from it.
  const auto agreements_at = [&](Tick tick) {
    messages = 0;
    cluster->step(push_at(tick));
    return messages / (2 * (kServers - 1));
  };
  for (Tick tick = 1; tick < 299; ++tick) agreements_at(tick);
  EXPECT_EQ(agreements_at(299), 2u) << "before the exchange, and after the seams, of which there are none";
  EXPECT_GE(agreements_at(300), 4u) << "the island at rest is heard of server by server";
  EXPECT_GT(cluster->counts().bodies_awake, 50u);
}

TEST(Links, JointsTieBodiesOfAnyTwoServers) {
  expect_same_bits(chain_world(sectors_of(1.75), 20, {0, 0, 10}), {3, 9, 12}, 150);
  expect_same_bits(net_world(sectors_of(2.5), 6, true), {9}, 60);
  expect_same_bits(bridge_world(sectors_of(3), 0.1), {9}, 100);
}

TEST(Links, JointsLedByAKinematicBodyAndTakenOff) {
  WorldBuilder builder(sectors_of(3));
  builder.add_floor(20, 0);
  builder.add_chain(8, {0.2, 3, 9}, {1, 0, 0});
  const ShapeId box = builder.shape(Box{{0.5, 0.5, 0.5}});
  builder.add("leader", box, 1, {-4, 6, 6}, Motion::kKinematic);
  builder.add("follower", box, 1, {-2.9, 6, 6});
  builder.tie("lead", JointType::kBall, "leader", "follower", {-3.4, 6, 6});
  for (const std::uint64_t shuffle : {0, 5}) {
    builder.world().settings.shuffle = shuffle;
    const std::uint64_t leader = 10;  // the floor, eight links, then this
    expect_same_bits(builder.world(), {3, 9}, 150, [&](Tick tick) -> std::vector<Command> {
      if (tick == 30) {
        BodyState state;
        state.position = {0.5, 0, 0};
        return {KinematicTarget{BodyId{leader}, {-1, 2, 2}, state, true}};
      }
      if (tick == 60) return {RemoveJoint{JointId{4}}};
      if (tick == 90) return {RemoveBody{BodyId{3}}};
      return {};
    });
  }
}

TEST(Links, ASnapshotGoesOnWithAnyNumberOfServersAndLinks) {
  const WorldDescription world = sleeping_row();
  const auto undisturbed = cluster_of(world, 12);
  change(*undisturbed, by_links);
  for (Tick tick = 1; tick <= 250; ++tick) undisturbed->step();
  const WorldSnapshot snapshot = undisturbed->snapshot();
  std::vector<std::unique_ptr<PartitionCluster>> restored;
  for (const std::uint32_t count : {1, 3, 9, 12}) {
    auto cluster = PartitionCluster::restore(snapshot, count);
    ASSERT_TRUE(cluster.ok()) << cluster.status();
    restored.push_back(std::move(*cluster));
  }
  for (Tick tick = 251; tick <= 460; ++tick) {
    undisturbed->step(push_at(tick));
    for (const auto& cluster : restored) {
      cluster->step(push_at(tick));
      ASSERT_EQ(cluster->hash(), undisturbed->hash()) << cluster->size() << " partitions, tick " << tick;
    }
  }
}

}  // namespace
}  // namespace tessera
