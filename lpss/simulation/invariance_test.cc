// The promises of the layer, held against each other by equality: moving a world, splitting it over
// partitions, and stepping it on threads must not change a bit.
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"

namespace tessera {
namespace {

using ::testing::Gt;
using ::testing::Lt;

TEST(Island, ATowerStandsAcrossASeam) {
  // L = 8: the tower from -1 to 9 m has its seams at z = 4.
  auto cluster = PartitionCluster::create(tower_world(sectors_of(8), 10, {0, 0, -1}), 1);
  ASSERT_TRUE(cluster.ok()) << cluster.status();
  std::uint64_t across = 0;
  for (int t = 0; t < 600; ++t) {
    (*cluster)->step();
    across = std::max(across, (*cluster)->counts().islands_across_seams);
  }
  EXPECT_EQ(across, 1u);
  double drift = 0;
  for (int i = 0; i < 10; ++i) {
    const BodyRecord box = *(*cluster)->body(BodyId{static_cast<std::uint64_t>(i) + 2});
    const double z = static_cast<double>(box.home.k) * 8 + box.state.position[2];
    const double x = static_cast<double>(box.home.i) * 8 + box.state.position[0];
    EXPECT_NEAR(z, i - 0.5, 0.02) << "box " << i;
    drift = std::max(drift, std::abs(x - 0.02 * ((i * 7) % 5 - 2)));
  }
  EXPECT_LT(drift, 0.06);
}

TEST(Clone, ThePapersClonesLetATowerFallThroughItsSeam) {
  auto cluster = PartitionCluster::create(tower_world(sectors_of(8, SeamPolicy::kClone), 10, {0, 0, -1}), 1);
  ASSERT_TRUE(cluster.ok()) << cluster.status();
  for (int t = 0; t < 600; ++t) (*cluster)->step();
  const BodyRecord top = *(*cluster)->body(BodyId{11});
  EXPECT_LT(static_cast<double>(top.home.k) * 8 + top.state.position[2], 8.0);
}

TEST(PlacementInvariance, ATowerOverTwoAndFourPartitions) {
  const WorldDescription world = tower_world(sectors_of(4), 10, {0, 0, -1});
  const std::vector<WorldHash> one = run(world, 1, 1, 300);
  EXPECT_EQ(first_difference(one, run(world, 2, 1, 300)), 300u);
  EXPECT_EQ(first_difference(one, run(world, 4, 1, 300)), 300u);
}

// A cluster that solves all islands in step that it can.
std::unique_ptr<PartitionCluster> in_step(const WorldDescription& world, std::uint32_t partitions) {
  std::unique_ptr<PartitionCluster> cluster = cluster_of(world, partitions);
  for (Rank rank = 0; rank < partitions; ++rank) cluster->partition(rank).in_step_from = 0;
  return cluster;
}

TEST(PlacementInvariance, APyramidThatServersSolveInStep) {
  for (const double sector_size : {4.0, 1.75}) {
    WorldDescription world = pyramid_world(sectors_of(sector_size), 12);
    world.settings.sleep_after = 0;
    const std::vector<WorldHash> one = run(world, 1, 1, 60);
    for (const std::uint32_t partitions : {2, 3, 8}) {
      const auto cluster = in_step(world, partitions);
      for (std::size_t tick = 0; tick < one.size(); ++tick) {
        cluster->step();
        ASSERT_EQ(cluster->hash(), one[tick]) << partitions << " partitions, tick " << tick;
        EXPECT_EQ(cluster->counts().islands_in_step, 1u);
        EXPECT_EQ(cluster->counts().islands_shipped, 0u);
      }
    }
  }
}

TEST(PlacementInvariance, AHeapThatBouncesAndServersSolveInStep) {
  WorldDescription world = pile_world(sectors_of(2), 150);
  for (BodyDescription& body : world.bodies) body.properties.restitution = 0.5;
  const std::vector<WorldHash> one = run(world, 1, 1, 240);
  const auto cluster = in_step(world, 5);
  std::uint64_t count = 0;
  for (std::size_t tick = 0; tick < one.size(); ++tick) {
    cluster->step();
    count += cluster->counts().islands_in_step;
    ASSERT_EQ(cluster->hash(), one[tick]) << "tick " << tick;
  }
  EXPECT_GT(count, 100u);
}

// What both servers know is not told again, though the border between them has corners.
TEST(InStep, TwoServersTellEachOtherOfMotionsOnceASweep) {
  const auto cluster = in_step(pyramid_world(sectors_of(4), 15), 2);
  for (int tick = 0; tick < 5; ++tick) cluster->step();
  const auto rounds_before = cluster->rounds();
  cluster->step();
  // Of each: exchange, seams, shipment, solution; 4 substeps of 3 passes.
  EXPECT_EQ(cluster->rounds() - rounds_before, 2 * (4 + 12));
}

TEST(PlacementInvariance, APileOverUpToEightPartitionsAndTwoThreads) {
  for (const SeamPolicy policy : {SeamPolicy::kIsland, SeamPolicy::kClone}) {
    const WorldDescription world = pile_world(sectors_of(16, policy), 200);
    const std::vector<WorldHash> one = run(world, 1, 1, 240);
    EXPECT_EQ(first_difference(one, run(world, 1, 2, 240)), 240u);
    EXPECT_EQ(first_difference(one, run(world, 2, 1, 240)), 240u);
    EXPECT_EQ(first_difference(one, run(world, 3, 2, 240)), 240u);
    EXPECT_EQ(first_difference(one, run(world, 8, 1, 240)), 240u);
  }
}

TEST(ThreadInvariance, AHeapInOneSectorOnUpToEightThreads) {
  WorldBuilder builder(sectors_of(256));
  builder.add_floor(40, 0);
  const ShapeId shapes[] = {builder.shape(Box{{1, 1, 1}}), builder.shape(Sphere{0.5})};
  constexpr int kSide = 12;
  for (int n = 0; n < 4 * kSide * kSide; ++n) {
    const int layer = n / (kSide * kSide);
    const double shift = 0.4 * (layer % 2);
    const Eigen::Vector3d place(n % kSide * 1.05 + shift, n / kSide % kSide * 1.05, 0.55 + 1.1 * layer);
    builder.add(absl::StrCat("body", n), shapes[n % 5 == 0 ? 1 : 0], 1, place);
  }
  const std::vector<WorldHash> one = run(builder.world(), 1, 1, 120);
  EXPECT_EQ(first_difference(one, run(builder.world(), 1, 2, 120)), 120u);
  EXPECT_EQ(first_difference(one, run(builder.world(), 1, 8, 120)), 120u);
}

TEST(TranslationInvariance, APileMovedByWholeSectors) {
  WorldDescription world = pile_world(sectors_of(16), 150);
  const std::vector<WorldHash> here = run(world, 1, 1, 200);
  constexpr std::int64_t kFar = std::int64_t{1} << 62;
  for (const SectorOffset offset : {SectorOffset{kFar, -kFar, kFar}, SectorOffset{-kFar, 7, 1 << 20}}) {
    WorldDescription moved = world;
    ASSERT_TRUE(move_by(moved, offset).ok());
    EXPECT_EQ(first_difference(here, run(moved, 2, 1, 200)), 200u);
  }
}

}  // namespace
}  // namespace tessera
