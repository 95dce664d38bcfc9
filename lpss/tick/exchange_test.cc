// Servers tell each other of the bodies near their seams: once who they are, then how they move, then that
// they are gone.
#include "lpss/tick/exchange.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/tick/seam_search.h"
#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

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

using ExchangeDeathTest = ExchangeTest;
TEST_F(ExchangeDeathTest, AnUpdateOfAStrangerStopsTheProcess) {
  add_body(*high_, box(1, kHigh, {-7, 0, 0}));
  std::vector<Exchange> inbox{{}, tell()};
  inbox[1].introductions.clear();
  EXPECT_DEATH(take_replicas(*low_, inbox), "a replica is introduced before it is updated");
}

}  // namespace
}  // namespace tessera
