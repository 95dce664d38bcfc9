#include "sector_server/peer_probes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr NodeId kPeer{7};
constexpr NodeId kOther{9};

PeerProbes::Wait wait_in(Tick tick, std::vector<NodeId> peers = {kPeer, kOther},
                         std::vector<NodeId> others = {}) {
  return {{.tick = tick, .map_epoch = 0, .number = 3}, std::move(peers), std::move(others)};
}

// "7: 250 silent"
std::vector<std::string> unheard(const PeerProbes& probes) {
  v1::Report report;
  probes.write(report);
  std::vector<std::string> texts;
  for (const v1::Unheard& one : report.unheard()) {
    texts.push_back(std::to_string(one.node()) + ": " + std::to_string(one.waited_ms()) +
                    (one.silent() ? " silent" : ""));
  }
  EXPECT_EQ(probes.any_unheard(), !texts.empty());
  return texts;
}

TEST(PeerProbesTest, NobodyIsAskedWhereRoundsGoOn) {
  PeerProbes probes;
  for (Tick tick = 1; tick < 10; ++tick) EXPECT_THAT(probes.look(wait_in(tick)), IsEmpty());
  EXPECT_THAT(probes.look(std::nullopt), IsEmpty());
  EXPECT_THAT(unheard(probes), IsEmpty());
}

TEST(PeerProbesTest, WhoDoesNotAnswerIsReported) {
  PeerProbes probes;
  probes.heard(kPeer);
  EXPECT_THAT(probes.look(wait_in(1)), IsEmpty()) << "it has just begun to wait";
  EXPECT_THAT(probes.look(wait_in(1)), ElementsAre(kPeer, kOther));
  EXPECT_THAT(unheard(probes), IsEmpty()) << "they have just been asked";
  probes.look(wait_in(1));
  EXPECT_THAT(unheard(probes), ElementsAre("7: 250", "9: 250 silent"));
  probes.lost(kPeer);
  probes.look(wait_in(1));
  EXPECT_THAT(unheard(probes), ElementsAre("7: 500 silent", "9: 500 silent"));
}

TEST(PeerProbesTest, AWordOfAPeerIsEnough) {
  PeerProbes probes;
  for (int n = 0; n < 5; ++n) probes.look(wait_in(1));
  probes.heard(kOther);
  EXPECT_THAT(unheard(probes), ElementsAre("7: 750 silent"));
  for (int n = 0; n < 2; ++n) probes.look(wait_in(1));
  EXPECT_THAT(unheard(probes), ElementsAre("7: 1250 silent", "9: 250"));
}

TEST(PeerProbesTest, AllAreAskedOnceOneDoesNotAnswer) {
  PeerProbes probes;
  const PeerProbes::Wait wait = wait_in(1, {kPeer}, {kOther});
  probes.look(wait);
  EXPECT_THAT(probes.look(wait), ElementsAre(kPeer));
  EXPECT_THAT(probes.look(wait), ElementsAre(kPeer, kOther));
  EXPECT_THAT(probes.look(wait), ElementsAre(kPeer, kOther));
  EXPECT_THAT(unheard(probes), ElementsAre("7: 500 silent", "9: 250 silent"));
  probes.heard(kPeer);
  EXPECT_THAT(probes.look(wait), ElementsAre(kPeer)) << "it is there";
}

TEST(PeerProbesTest, NothingCountsOnceTheWorldHasGoneOn) {
  PeerProbes probes;
  for (int n = 0; n < 4; ++n) probes.look(wait_in(1));
  EXPECT_THAT(probes.look(wait_in(2)), IsEmpty());
  EXPECT_THAT(unheard(probes), IsEmpty());
  for (int n = 0; n < 4; ++n) probes.look(wait_in(2));
  EXPECT_THAT(probes.look(std::nullopt), IsEmpty());
  EXPECT_THAT(unheard(probes), IsEmpty());
}

}  // namespace
}  // namespace tessera
