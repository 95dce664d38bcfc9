// Sectors change servers, and the world does not notice.
#include "lpss/tick/transfer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/observe/state.h"
#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

TEST(Transfer, MovesSectorsOnlyWhileAuthorityIsShuffled) {
  TestPartition usual;
  WorldSettings settings = test_settings();
  settings.shuffle = 3;
  TestPartition shuffled(settings);
  int moves = 0;
  for (Tick tick = 1; tick <= 300; ++tick) {
    EXPECT_FALSE(shuffled_map(*usual, tick));
    moves += shuffled_map(*shuffled, tick) ? 1 : 0;
  }
  EXPECT_NEAR(moves, 100, 30) << "one tick in three";
}

TEST(Transfer, EverySectorIsAtItsNewServerWithTheSameBits) {
  TestWorld world(2);
  for (std::int64_t i = -8; i < 8; ++i) {
    const auto id = static_cast<std::uint64_t>(2 * i + 17);
    world.add(moving(box(id, {i, 0, 0}, kBeforeBorder), {1, 2, 3}));
    world.add(box(id + 1, {i, 0, 0}, kBehindBorder));
  }
  world.run_to_solved();
  const auto hash = [&] {
    WorldHash sum = hash_of(world[0]);
    sum.add(hash_of(world[1]));
    return sum;
  };
  const WorldHash before = hash();
  std::vector<std::vector<Transfer>> outboxes;
  for (const Rank rank : {0, 1}) {
    const SectorMap next = SectorMap::scattered(world[rank].anchor, 2, 5, world[rank].map.epoch() + 1);
    outboxes.push_back(give_sectors(world[rank], {next, rank}));
  }
  EXPECT_FALSE(outboxes[0][1].sectors.empty());
  EXPECT_FALSE(outboxes[1][0].sectors.empty());
  EXPECT_TRUE(outboxes[0][0].sectors.empty());
  for (const Rank rank : {0, 1}) {
    take_sectors(world[rank], received(outboxes, rank));
    check_invariants(world[rank]);
    EXPECT_EQ(world[rank].map.epoch(), 2u);
  }
  EXPECT_EQ(world[0].bodies.size() + world[1].bodies.size(), 32u);
  EXPECT_EQ(hash(), before);
}

}  // namespace
}  // namespace tessera
