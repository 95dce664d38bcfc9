// Which bodies touch, as the last tick left it: at rest and packed, too, and whoever hosts them.
#include "lpss/observe/contacts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"
#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

constexpr std::uint64_t kAtOnce = 0;
constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();

// Of all partitions, bit by bit.
using Told = std::tuple<BodyId, BodyId, double, double, std::array<double, 3>, std::array<double, 3>,
                        std::size_t, WorldPosition>;

std::vector<Told> told(PartitionCluster& cluster, const std::vector<BodyId>& bodies) {
  std::vector<Told> all;
  for (Rank rank = 0; rank < cluster.size(); ++rank) {
    for (const TouchingPatch& patch : contacts_of(cluster.partition(rank), bodies)) {
      all.emplace_back(patch.a, patch.b, patch.impulse, patch.depth, patch.normal, patch.friction,
                       patch.points.size(), patch.position);
    }
  }
  std::ranges::stable_sort(all, {}, [](const Told& x) { return std::pair(std::get<0>(x), std::get<1>(x)); });
  return all;
}

std::unique_ptr<PartitionCluster> cluster_that_packs(const WorldDescription& world, std::uint32_t partitions,
                                                     std::uint64_t pack_after) {
  std::unique_ptr<PartitionCluster> cluster = cluster_of(world, partitions);
  for (Rank rank = 0; rank < partitions; ++rank) cluster->partition(rank).pack_after = pack_after;
  return cluster;
}

std::size_t packed_bodies(PartitionCluster& cluster) {
  std::size_t sum = 0;
  for (Rank rank = 0; rank < cluster.size(); ++rank) sum += cluster.partition(rank).packed.counts().bodies;
  return sum;
}

TEST(Contacts, WhatStandsBearsItsWeightAndStillDoesAsleep) {
  WorldBuilder builder(sectors_of(8));
  builder.add_floor(10, 0);
  builder.add("box", builder.shape(Box{{1, 1, 1}}), 5, {3.9, 0, 0.5});
  const auto cluster = cluster_that_packs(builder.world(), 2, kAtOnce);
  for (int tick = 0; tick < 20; ++tick) cluster->step();
  const std::vector<BodyId> boxes{BodyId{2}};
  const std::vector<Told> awake = told(*cluster, boxes);
  ASSERT_EQ(awake.size(), 1u);
  EXPECT_EQ(std::get<0>(awake[0]), BodyId{1});
  EXPECT_EQ(std::get<1>(awake[0]), BodyId{2});
  EXPECT_NEAR(std::get<2>(awake[0]), 5 * 9.81 / 60, 0.02) << "N s of a tick";
  EXPECT_EQ(std::get<6>(awake[0]), 4u);
  for (int tick = 0; tick < 200; ++tick) cluster->step();
  ASSERT_EQ(packed_bodies(*cluster), 1u) << "it sleeps, and so does its sector";
  for (const std::vector<BodyId>& asked : {std::vector{BodyId{1}}, boxes}) {
    const std::vector<Told> asleep = told(*cluster, asked);
    ASSERT_EQ(asleep.size(), 1u);
    EXPECT_NEAR(std::get<2>(asleep[0]), 5 * 9.81 / 60, 0.02);
  }
}

TEST(Contacts, AreTheSameOnAnyNumberOfServersAndPackedOrNot) {
  WorldDescription world = pile_world(sectors_of(4), 80);
  world.settings.sleep_after = 0.1;
  const auto one = cluster_that_packs(world, 1, kNever);
  const auto four = cluster_that_packs(world, 4, kAtOnce);
  std::vector<BodyId> all;
  std::size_t packed = 0;
  for (std::uint64_t id = 1; id <= 81; ++id) all.push_back(BodyId{id});
  const std::vector<BodyId> some{BodyId{7}, BodyId{40}, BodyId{41}};
  for (int tick = 0; tick < 600; ++tick) {
    one->step();
    four->step();
    packed += packed_bodies(*four);
    if (tick % 100 != 99) continue;
    const std::vector<Told> expected = told(*one, all);
    EXPECT_GT(expected.size(), 40u);
    EXPECT_EQ(told(*four, some), told(*one, some)) << tick;
    EXPECT_EQ(told(*four, all), expected) << tick;
    EXPECT_EQ(one->hash(), four->hash()) << tick;
  }
  EXPECT_GT(packed, 0u);
}

TEST(Contacts, OfABodyThatIsNotThereThereAreNone) {
  TestWorld world(2);
  EXPECT_TRUE(contacts_of(world[0], std::vector{BodyId{5}}).empty());
}

}  // namespace
}  // namespace tessera
