// A client that takes nothing gets fewer states, then none, and never costs more than its queue may.
#include "sector_server/subscription.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tessera {
namespace {

using namespace std::chrono_literals;
using Numbers = Subscription<int, std::uint64_t>;

constexpr std::size_t kLarge = kStreamBytesMax / 8;

struct Stalled {
  // States of `bytes` each, tick after tick, until the queue is full.
  explicit Stalled(std::size_t bytes) {
    for (; queue.thinning() == 1; ++tick) queue.push_state(tick, bytes, start);
  }

  const Numbers::Time start = Numbers::Time::clock::now();
  Numbers queue{0};
  std::uint64_t tick = 1;
};

TEST(Subscription, LeavesOutStatesForWhichThereIsNoRoom) {
  Stalled stalled(kLarge);
  EXPECT_EQ(stalled.queue.bytes(), kStreamBytesMax);
  EXPECT_EQ(stalled.queue.thinning(), 2u);
  for (int n = 0; n < 20; ++n) stalled.queue.push_state(0, kLarge, stalled.start + 9s);
  EXPECT_EQ(stalled.queue.thinning(), kThinningMax);
  EXPECT_EQ(stalled.queue.bytes(), kStreamBytesMax);
  for (std::uint64_t tick = 1; tick <= 8; ++tick) EXPECT_EQ(stalled.queue.next(0ms), tick);
  EXPECT_EQ(stalled.queue.next(0ms), std::nullopt);
  EXPECT_TRUE(stalled.queue.alive());
  stalled.queue.push_state(64, 1, stalled.start + 10s);
  EXPECT_EQ(stalled.queue.thinning(), kThinningMax / 2) << "it keeps up again";
}

TEST(Subscription, CountsStatesAsWellAsBytes) {
  const Stalled stalled(1);
  EXPECT_EQ(stalled.queue.bytes(), kStreamBatchesMax);
}

TEST(Subscription, EndsWhereTheClientTakesNothing) {
  Stalled stalled(kLarge);
  stalled.queue.push_state(0, kLarge, stalled.start + kStalledMax + 1s);
  EXPECT_FALSE(stalled.queue.alive());
  EXPECT_TRUE(stalled.queue.overrun_since());
  EXPECT_EQ(stalled.queue.bytes(), 0u) << "nothing is kept";
  stalled.queue.push_state(0, 1, stalled.start);
  EXPECT_EQ(stalled.queue.bytes(), 0u);
}

TEST(Subscription, NeverLeavesOutAnEvent) {
  Numbers queue(0);
  for (int n = 0; n < 8; ++n) queue.push(0, kLarge);
  EXPECT_TRUE(queue.alive());
  queue.push(0, 1);
  EXPECT_FALSE(queue.alive());
  EXPECT_TRUE(queue.overrun_since());
}

TEST(Subscription, KeepsNoMemoryOfLargeBatches) {
  for (const std::size_t bytes : {kKeptBytesMax, kKeptBytesMax + 1}) {
    Numbers queue(0);
    queue.push(7, bytes);
    queue.take_back(*queue.next(0ms));
    EXPECT_EQ(queue.spare(), bytes == kKeptBytesMax ? 7u : 0u);
  }
}

// A thread that sends is with a batch for as long as its client does not read.
TEST(Subscription, CountsWhatIsOnItsWay) {
  Numbers queue(0);
  queue.push(1, kLarge);
  queue.push(2, 1);
  EXPECT_EQ(queue.next(0ms), 1u);
  EXPECT_EQ(queue.bytes(), 1 + kCopiesOnTheWay * kLarge);
  queue.take_back(1);
  EXPECT_EQ(queue.bytes(), 1u);
}

TEST(Subscription, IsStuckWhereTheClientDoesNotReadABatch) {
  Numbers queue(0);
  const auto later = [](std::chrono::seconds time) { return Numbers::Time::clock::now() + time; };
  queue.push(1, 10 * kBytesPerSecondSlowest);
  EXPECT_FALSE(queue.is_stuck(later(1h))) << "nothing is on its way";
  EXPECT_EQ(queue.next(0ms), 1u);
  EXPECT_FALSE(queue.is_stuck(later(kPieceMax)));
  EXPECT_TRUE(queue.is_stuck(later(kPieceMax + 11s)));
  queue.take_back(1);
  EXPECT_FALSE(queue.is_stuck(later(1h)));
}

TEST(Subscription, HasRoomForOneBatchOfAnySize) {
  Numbers queue(0);
  queue.push(7, 100 * kStreamBytesMax);
  EXPECT_EQ(queue.next(0ms), 7u);
  EXPECT_TRUE(queue.alive());
}

}  // namespace
}  // namespace tessera
