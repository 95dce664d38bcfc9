// A body beyond the hysteresis is announced, and moves one tick later.
#include "lpss/tick/homes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "lpss/tick/seam_search.h"
#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr double kLimit = 8 + 1.0 / 32;  // m: half a sector and the hysteresis
constexpr double kLittle = 1.0 / 1024;   // m

TEST(Homes, AChangeIsAnnouncedOnlyBeyondTheHysteresis) {
  TestPartition partition;
  add_body(*partition, box(1, kLow, {kLimit, 0, 0}));
  add_body(*partition, box(2, kLow, {kLimit + kLittle, 3, 0}));
  attend_borders(*partition);
  std::vector<Stopped> stopped;
  announce_home_changes(*partition, stopped);
  EXPECT_THAT(stopped, IsEmpty());
  EXPECT_FALSE(body(*partition, 1).next_home);
  EXPECT_EQ(body(*partition, 2).next_home, kHigh);
  EXPECT_THAT(partition->leaving, ElementsAre(BodyId{2}));
  EXPECT_EQ(body(*partition, 2).sector->index, kLow) << "it still lives where it lived";
}

TEST(Homes, WhatWasAnnouncedIsHandedToTheServerOfTheNewHome) {
  TestWorld world(2);
  world.add(moving(box(2, kLow, {kLimit + kLittle, 3, 0}), {1, 0, 0}));
  world.exchange();
  attend_borders(world[0]);
  std::vector<Stopped> stopped;
  announce_home_changes(world[0], stopped);
  std::vector<std::vector<Exchange>> outboxes(2, std::vector<Exchange>(2));
  change_homes(world[0], {}, outboxes[0]);
  EXPECT_THAT(world[0].bodies, IsEmpty());
  EXPECT_THAT(world[0].leaving, IsEmpty());
  EXPECT_THAT(outboxes[0][0].handovers, IsEmpty());
  ASSERT_EQ(outboxes[0][1].handovers.size(), 1u);
  ASSERT_EQ(outboxes[0][0].replicas.size(), 1u) << "the old home speaks for it once more";
  EXPECT_EQ(outboxes[0][0].introductions.size(), 1u) << "it is near the border, seen from above";

  std::vector<Exchange> inbox = received(outboxes, 1);
  take_homes(world[1], inbox);
  const HomeBody& moved = body(world[1], 2);
  EXPECT_EQ(moved.sector->index, kHigh);
  EXPECT_TRUE(moved.dirty);
  const BodyState state = state_of(world[1], 2);
  EXPECT_THAT(state.position, ElementsAre(kLimit + kLittle - 16, 3, 0));
  EXPECT_THAT(state.linear_velocity, ElementsAre(1, 0, 0));
}

TEST(Homes, AFastBodyThatArrivesMayBeOnItsWayToTheNext) {
  TestWorld world(2);
  world.add(moving(box(2, kLow, {0, 3, 0}), {16 * 64, 0, 0}));
  attend_borders(world[0]);
  std::vector<Stopped> stopped;
  announce_home_changes(world[0], stopped);
  EXPECT_EQ(body(world[0], 2).next_home, kHigh);
  BodyState after = state_of(world[0], 2);
  after.position[0] = 16;
  body(world[0], 2).sector->world->set_state(body(world[0], 2).slot, after);
  std::vector<std::vector<Exchange>> outboxes(2, std::vector<Exchange>(2));
  change_homes(world[0], {}, outboxes[0]);
  const SectorIndex third = *translated(kHigh, {1, 0, 0});
  ASSERT_EQ(outboxes[0][0].replicas.size(), 1u);
  EXPECT_EQ(outboxes[0][0].replicas[0].home, kHigh);
  EXPECT_EQ(outboxes[0][0].replicas[0].next_home, third);
  std::vector<Exchange> inbox = received(outboxes, 1);
  take_homes(world[1], inbox);
  EXPECT_EQ(body(world[1], 2).next_home, third);
  EXPECT_THAT(world[1].leaving, ElementsAre(BodyId{2}));
}

// Far ahead, its position has fewer digits than where it was.
TEST(Homes, OthersAreToldOfABodyAsTheEngineOfItsNewHomeRoundsIt) {
  TestWorld world(2);
  world.add(moving(box(2, kLow, {0.7, 3, 0}), {16 * 64 * 20, 0, 0}));
  attend_borders(world[0]);
  std::vector<Stopped> stopped;
  announce_home_changes(world[0], stopped);
  std::vector<std::vector<Exchange>> outboxes(2, std::vector<Exchange>(2));
  change_homes(world[0], {}, outboxes[0]);
  ASSERT_EQ(outboxes[0][0].replicas.size(), 1u);
  std::vector<Exchange> inbox = received(outboxes, 1);
  take_homes(world[1], inbox);
  EXPECT_LT(state_of(world[1], 2).position[0], -200);
  EXPECT_EQ(outboxes[0][0].replicas[0].state.position, state_of(world[1], 2).position);
}

TEST(Homes, ABodyThatArrivesAsleepWakesUp) {
  TestPartition partition;
  std::vector<Exchange> inbox(1);
  inbox[0].handovers.push_back({in_state(box(1, kHigh, {0, 0, 0}), Activity::kAsleep), {}, true});
  take_homes(*partition, inbox);
  EXPECT_EQ(activity_of(*partition, 1), Activity::kAwake);
  EXPECT_TRUE(body(*partition, 1).known_everywhere);
}

TEST(Homes, ABodyIsStoppedAtTheEdgeOfTheWorld) {
  TestPartition partition;
  const SectorIndex last{std::numeric_limits<std::int64_t>::max(), 0, 0};
  add_body(*partition, moving(box(1, last, {9, 0, 0}), {100, 0, 0}));
  attend_borders(*partition);
  std::vector<Stopped> stopped;
  announce_home_changes(*partition, stopped);
  ASSERT_EQ(stopped.size(), 1u);
  EXPECT_EQ(stopped[0].body, BodyId{1});
  EXPECT_EQ(stopped[0].kind, DivergenceKind::kSector);
  EXPECT_FALSE(body(*partition, 1).next_home);
  EXPECT_THAT(partition->leaving, IsEmpty());
  EXPECT_THAT(state_of(*partition, 1).linear_velocity, ElementsAre(0, 0, 0));
  const HomeBody& there = body(*partition, 1);
  EXPECT_TRUE(there.swept.isApprox(there.sector->world->swept_box(there.slot, partition->dt())))
      << "others are not told of a way that it does not go";
  EXPECT_THAT(state_of(*partition, 1).position, ElementsAre(partition->sector_size() / 2, 0, 0));
}

TEST(HomesDeathTest, ABodyForAnotherServerStopsTheProcess) {
  TestPartition low(test_settings(), 2, 0);
  std::vector<Exchange> inbox(2);
  inbox[0].handovers.push_back({box(1, kHigh, {0, 0, 0}), {}});
  EXPECT_DEATH(take_homes(*low, inbox), "handed to the server that hosts its new home");
}

}  // namespace
}  // namespace tessera
