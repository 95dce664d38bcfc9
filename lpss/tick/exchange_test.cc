// Servers tell each other of the bodies near their seams: once who they are, then how they move, then that
// they are gone.
#include "lpss/tick/exchange.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <tuple>
#include <vector>

#include "lpss/tick/homes.h"
#include "lpss/tick/seam_search.h"
#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

// How much of each kind a message has.
struct Told {
  std::size_t introductions;
  std::size_t replicas;
  std::size_t gone;
  friend bool operator==(const Told&, const Told&) = default;
};

class ExchangeTest : public testing::Test {
 protected:
  // What the server of kHigh tells the one of kLow.
  Exchange tell() {
    std::vector<Exchange> outbox(2);
    attend_borders(*high_);
    search_seams(*high_);
    tell_of_replicas(*high_, outbox);
    return outbox[0];
  }
  Told told() {
    const Exchange message = tell();
    return {message.introductions.size(), message.replicas.size(), message.gone.size()};
  }

  TestPartition low_{test_settings(), 2, 0};
  TestPartition high_{test_settings(), 2, 1};
};

TEST_F(ExchangeTest, ABodyIsIntroducedOnceThenUpdatedThenGone) {
  add_body(*high_, box(1, kHigh, {0, 0, 0}));
  EXPECT_EQ(told(), (Told{0, 0, 0}));
  put(*high_, 1, {-7, 0, 0});
  EXPECT_EQ(told(), (Told{1, 1, 0}));
  EXPECT_EQ(told(), (Told{0, 1, 0}));
  put(*high_, 1, {0, 0, 0});
  EXPECT_EQ(told(), (Told{0, 0, 1}));
  EXPECT_EQ(told(), (Told{0, 0, 0}));
}

TEST_F(ExchangeTest, ABodyThatFallsAsleepIsToldOfOnceMore) {
  add_body(*high_, box(1, kHigh, {-7, 0, 0}));
  EXPECT_EQ(told(), (Told{1, 1, 0}));
  HomeBody& sleeper = body(*high_, 1);
  sleeper.sector->world->sleep(sleeper.slot);
  sleeper.dirty = true;
  EXPECT_EQ(told(), (Told{0, 1, 0}));
  EXPECT_EQ(told(), (Told{0, 0, 0}));
}

TEST_F(ExchangeTest, AReplicaIsListedWhereItIsNeededUntilItIsGone) {
  add_body(*high_, box(1, kHigh, {-7, 0, 0}));
  body(*high_, 1).next_home = kLow;
  std::vector<Exchange> inbox{{}, tell()};
  take_replicas(*low_, inbox);
  const Replica& replica = *low_->replicas.at(BodyId{1});
  EXPECT_EQ(replica.home, kHigh);
  EXPECT_EQ(bits(replica.state), bits(state_of(*high_, 1)));
  ASSERT_EQ(replica.clones.size(), 1u);
  EXPECT_EQ(sector(*low_, kLow).clones.at(BodyId{1}), replica.clones[0].get());
  EXPECT_THAT(low_->moving_replicas, ElementsAre(BodyId{1}));

  inbox = {{}, {}};
  inbox[1].gone = {BodyId{1}};
  take_replicas(*low_, inbox);
  EXPECT_THAT(low_->replicas, IsEmpty());
  EXPECT_THAT(low_->moving_replicas, IsEmpty());
  EXPECT_THAT(sector(*low_, kLow).clones, IsEmpty());
}

// A row of sectors with bodies at their borders, of which every tenth changes its home.
class Row {
 public:
  Row() {
    for (std::uint64_t n = 0; n < kSectors * kBodies; ++n) {
      const SectorIndex home{static_cast<std::int64_t>(n % kSectors), 0, 0};
      const double y = -5 + static_cast<double>(n / kSectors) / 2;  // far from other borders
      add_body(*partition_, box(n + 1, home, {n % 10 == 0 ? -8.5 : -7.5, y, 0}));
    }
  }

  void exchange(const ParallelFor& parallel) {
    std::vector<Exchange> messages(1);
    std::vector<Stopped> stopped;
    attend_borders(*partition_);
    announce_home_changes(*partition_, stopped, parallel);
    search_seams(*partition_);
    tell_of_replicas(*partition_, messages, parallel);
    take_replicas(*partition_, messages, parallel);
    told_.clear();
    for (const ReplicaUpdate& update : messages[0].replicas) told_.push_back(update.id);
  }

  // The bodies that were told of, those that change their home, by those who let them go and those who hear
  // of it, and how many clones there are.
  auto outcome() {
    std::size_t clones = 0;
    for (const auto& [index, sector] : partition_->sectors) clones += sector->clones.size();
    return std::tuple(told_, partition_->leaving, partition_->moving_replicas, clones);
  }

 private:
  static constexpr std::uint64_t kSectors = 40;
  static constexpr std::uint64_t kBodies = 20;  // of a sector

  TestPartition partition_;
  std::vector<BodyId> told_;
};

TEST(Exchanges, AreTheSameInPiecesAndOnOneThread) {
  Row row;
  Row in_pieces;
  for (int tick = 0; tick < 2; ++tick) {
    row.exchange({});
    in_pieces.exchange(kLastFirst);
    EXPECT_EQ(row.outcome(), in_pieces.outcome()) << "tick " << tick;
  }
  const auto [told, leaving, moving, clones] = row.outcome();
  EXPECT_EQ(told.size(), 800u);
  EXPECT_THAT(moving, SizeIs(80));
  EXPECT_EQ(clones, 800u);
}

using ExchangeDeathTest = ExchangeTest;
TEST_F(ExchangeDeathTest, AnUpdateOfAStrangerStopsTheProcess) {
  add_body(*high_, box(1, kHigh, {-7, 0, 0}));
  std::vector<Exchange> inbox{{}, tell()};
  inbox[1].introductions.clear();
  EXPECT_DEATH(take_replicas(*low_, inbox), "a replica is introduced before it is updated");
}

}  // namespace
}  // namespace tessera
