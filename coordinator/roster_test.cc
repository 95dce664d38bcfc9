#include "coordinator/roster.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "coordinator/test_cluster.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr NodeId kGuest{3};

Roster hosting() {
  Roster roster({kFirst, kSecond});
  roster.has_world(0);
  roster.has_world(1);
  return roster;
}

v1::SectorMap map_of(std::initializer_list<NodeId> nodes, std::uint32_t newcomers) {
  v1::SectorMap map;
  for (const NodeId node : nodes) map.add_nodes(node.value);
  map.set_newcomers(newcomers);
  return map;
}

v1::Subscriptions bodies() {
  v1::Subscriptions subscriptions;
  subscriptions.add_all()->mutable_bodies();
  return subscriptions;
}

TEST(Roster, AWorldIsHostedOnceAllHaveIt) {
  Roster roster({kFirst, kSecond});
  EXPECT_FALSE(roster.hosts());
  roster.has_world(1);
  EXPECT_FALSE(roster.hosts());
  roster.has_world(0);
  EXPECT_TRUE(roster.hosts());
  EXPECT_FALSE(Roster({}).hosts()) << "by nobody";
}

TEST(Roster, AGuestHearsOfGrantsAndBecomesTheLastRank) {
  Roster roster = hosting();
  roster.invite(kGuest);
  EXPECT_THAT(roster.listeners(), ElementsAre(kFirst, kSecond, kGuest));
  EXPECT_TRUE(roster.needs(kGuest));
  EXPECT_FALSE(roster.cannot_lose(kGuest));
  roster.guest_is_ready();
  roster.change(map_of({kFirst, kSecond, kGuest}, 1));
  EXPECT_EQ(roster.rank_of(kGuest), 2u);
  EXPECT_FALSE(roster.guest());
  EXPECT_TRUE(roster.hosts());
  EXPECT_EQ(roster.joined(), 1u);
}

TEST(Roster, WhoLeavesIsNeededUntilOthersHaveTheMapAndClientsHaveHadTime) {
  Roster roster = hosting();
  roster.change(map_of({kSecond}, 0));
  EXPECT_EQ(roster.rank_of(kSecond), 0u);
  EXPECT_EQ(roster.left(), 1u);
  EXPECT_TRUE(roster.cannot_lose(kFirst));
  roster.release_leaver(std::chrono::seconds(1));
  EXPECT_FALSE(roster.cannot_lose(kFirst));
  EXPECT_TRUE(roster.needs(kFirst));
  roster.drop_leaver();
  EXPECT_FALSE(roster.needs(kFirst));
}

TEST(Roster, AWorldThatGoesBackIsDroppedByThoseThatAreNotChosen) {
  Roster roster = hosting();
  roster.invite(kGuest);
  roster.add_unfit(kGuest);
  EXPECT_THAT(roster.restart({kSecond}), ElementsAre(kFirst, kGuest));
  EXPECT_THAT(roster.nodes(), ElementsAre(kSecond));
  EXPECT_FALSE(roster.hosts());
  EXPECT_FALSE(roster.guest());
  EXPECT_THAT(roster.unfit(), IsEmpty());
}

TEST(Roster, StreamsOfAllServersAreHandedOverOnceEach) {
  Roster roster = hosting();
  roster.subscribe(kFirst, bodies());
  roster.subscribe(kSecond, bodies());
  EXPECT_EQ(roster.all_subscriptions().all_size(), 1);
  v1::Subscriptions contacts;
  contacts.add_all()->mutable_contacts();
  roster.subscribe(kSecond, contacts);
  EXPECT_EQ(roster.take_subscriptions().all_size(), 2);
  EXPECT_EQ(roster.all_subscriptions().all_size(), 0);
}

TEST(RosterDeathTest, OneServerAtATimeGetsReady) {
  Roster roster = hosting();
  roster.invite(kGuest);
  EXPECT_DEATH(roster.invite(NodeId{4}), "one server at a time");
}

}  // namespace
}  // namespace tessera
