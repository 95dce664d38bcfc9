#include "lpss/tick/agreement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace tessera {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

// Lets servers agree on what they say, whoever is first. The most messages that one of them has sent or got.
std::size_t agree(std::vector<Agreement> said, std::vector<AgreementTree>& trees) {
  const std::size_t servers = said.size();
  trees.resize(servers);
  std::vector<std::optional<Round>> rounds(servers);
  std::vector<std::vector<std::optional<Agreement>>> inboxes(servers);
  std::vector<std::size_t> messages(servers, 0);
  const auto post = [&](Rank from) {
    for (Rank to = 0; rounds[from] && to < servers; ++to) {
      if (!rounds[from]->to[to]) continue;
      inboxes[to][from] = std::get<Agreement>(*rounds[from]->to[to]);
      ++messages[from];
      ++messages[to];
    }
  };
  for (auto& inbox : inboxes) inbox.resize(servers);
  for (Rank rank = 0; rank < servers; ++rank) {
    rounds[rank] = trees[rank].begin(rank, servers, said[rank], 0);
    post(rank);
  }
  for (bool moved = true; moved;) {
    moved = false;
    for (Rank rank = 0; rank < servers; ++rank) {
      if (!rounds[rank]) continue;
      std::vector<Agreement> inbox(servers);
      bool complete = true;
      for (Rank from = 0; from < servers; ++from) {
        complete &= !rounds[rank]->from[from] || inboxes[rank][from].has_value();
        if (inboxes[rank][from]) inbox[from] = *inboxes[rank][from];
      }
      if (!complete) continue;
      rounds[rank] = trees[rank].advance(inbox);
      post(rank);
      moved = true;
    }
  }
  for (const auto& round : rounds) EXPECT_FALSE(round) << "all end";
  return *std::max_element(messages.begin(), messages.end());
}

TEST(Agreement, AllHearWhatOneSays) {
  for (const std::size_t servers : {1, 2, 9, 10, 64, 73, 74, 600}) {
    for (const std::size_t one : {std::size_t{0}, servers / 2, servers - 1}) {
      std::vector<Agreement> said(servers);
      said[one].quiet = false;
      said[one].goes_on = true;
      std::vector<AgreementTree> trees;
      EXPECT_LE(agree(said, trees), 2u * (kTreeFan + 1)) << servers;
      for (const AgreementTree& tree : trees) {
        EXPECT_FALSE(tree.result().quiet);
        EXPECT_TRUE(tree.result().goes_on);
      }
    }
    std::vector<AgreementTree> trees;
    agree(std::vector<Agreement>(servers), trees);
    for (const AgreementTree& tree : trees) EXPECT_TRUE(tree.result().quiet && !tree.result().goes_on);
  }
}

TEST(Agreement, ACallReachesTheOneThatItIsFor) {
  constexpr Rank kServers = 80;
  std::vector<Agreement> said(kServers);
  for (Rank from = 0; from < kServers; ++from) said[from].calls = {{from, (from * 37 + 11) % kServers}};
  std::vector<AgreementTree> trees;
  agree(said, trees);
  for (Rank from = 0; from < kServers; ++from) {
    const Rank to = (from * 37 + 11) % kServers;
    ASSERT_THAT(trees[to].result().calls, SizeIs(1));
    EXPECT_EQ(trees[to].result().calls[0].from, from);
  }
}

TEST(Agreement, TheEndsOfAJointFindEachOther) {
  constexpr Rank kServers = 80;
  for (const auto& [a, b] : {std::pair<Rank, Rank>(0, 79), {3, 71}, {17, 18}, {25, 3}}) {
    std::vector<Agreement> said(kServers);
    said[a].joint_ends = {{BodyId{5}, BodyId{6}, a}, {BodyId{5}, BodyId{6}, a}};
    said[b].joint_ends = {{BodyId{6}, BodyId{5}, b}};
    said[40].joint_ends = {{BodyId{8}, BodyId{9}, 40}};  // nobody has the other
    std::vector<AgreementTree> trees;
    agree(said, trees);
    ASSERT_THAT(trees[a].result().joint_hosts, SizeIs(1));
    EXPECT_EQ(trees[a].result().joint_hosts[0].body, BodyId{6});
    EXPECT_EQ(trees[a].result().joint_hosts[0].host, b);
    ASSERT_THAT(trees[b].result().joint_hosts, SizeIs(1));
    EXPECT_EQ(trees[b].result().joint_hosts[0].body, BodyId{5});
    EXPECT_EQ(trees[b].result().joint_hosts[0].host, a);
    EXPECT_THAT(trees[40].result().joint_hosts, IsEmpty());
  }
}

TEST(Agreement, ABodyThatComesToLiveWhereItsPartnerIsNeedsNoServer) {
  std::vector<Agreement> said(12);
  said[9].joint_ends = {{BodyId{5}, BodyId{6}, 2}};  // hands it to 2
  said[2].joint_ends = {{BodyId{6}, BodyId{5}, 2}};
  std::vector<AgreementTree> trees;
  agree(said, trees);
  for (const AgreementTree& tree : trees) EXPECT_THAT(tree.result().joint_hosts, IsEmpty());
}

}  // namespace
}  // namespace tessera
