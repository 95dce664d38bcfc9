// Islands fall asleep and wake up as a unit; sectors at rest leave the list.
#include "lpss/tick/sleep.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// Two boxes that touch over the border, taken through the planning of islands.
std::unique_ptr<TestWorld> planned_pair(std::uint32_t servers, Activity low, Activity high) {
  auto world = std::make_unique<TestWorld>(servers);
  world->add(in_state(box(1, kLow, kBeforeBorder), low));
  world->add(in_state(box(2, kHigh, kBehindBorder), high));
  world->exchange();
  world->detect();
  world->connect();
  world->plan();
  return world;
}

TEST(Sleep, AnIslandFallsAsleepOnceAllOfItWantsTo) {
  for (const std::uint32_t servers : {1, 2}) {
    const auto ready = planned_pair(servers, Activity::kWantsSleep, Activity::kWantsSleep);
    EXPECT_EQ(ready->state(1).activity, Activity::kAsleep);
    EXPECT_EQ(ready->state(2).activity, Activity::kAsleep);
    EXPECT_THAT(ready->contexts[0].plan.jobs, IsEmpty());

    const auto waiting = planned_pair(servers, Activity::kWantsSleep, Activity::kAwake);
    EXPECT_EQ(waiting->state(1).activity, Activity::kWantsSleep);
    EXPECT_EQ(waiting->state(2).activity, Activity::kAwake);
  }
}

TEST(Sleep, WhatWakesUpTakesPartInTheTick) {
  TestPartition partition;
  add_body(*partition, in_state(box(1, kHigh, {0, 0, 0}), Activity::kAsleep));
  Sector& high = sector(*partition, kHigh);
  high.active = false;
  partition->active.clear();
  body(*partition, 1).dirty = false;
  high.component_bodies = {&body(*partition, 1)};
  Component component;
  component.bodies_end = 1;
  component.any_asleep = true;
  TickContext context;
  settle(*partition, context, high, component, /*all_want_sleep=*/false);
  EXPECT_EQ(activity_of(*partition, 1), Activity::kAwake);
  EXPECT_THAT(context.stepped, ElementsAre(&high));
  EXPECT_THAT(partition->active, ElementsAre(&high));
  settle(*partition, context, high, component, /*all_want_sleep=*/true);
  EXPECT_EQ(activity_of(*partition, 1), Activity::kAsleep);
  EXPECT_TRUE(body(*partition, 1).dirty);
}

TEST(Sleep, ASectorStaysOnTheListWhileSomethingIsAwakeOrNotYetKnown) {
  TestPartition partition;
  const SectorIndex unknown{5, 0, 0};
  const SectorIndex at_rest{6, 0, 0};
  const SectorIndex on_the_move{7, 0, 0};
  add_body(*partition, box(1, kHigh, {0, 0, 0}));
  for (const auto& [id, home] : {std::pair(2, unknown), std::pair(3, at_rest), std::pair(4, on_the_move)}) {
    add_body(*partition, in_state(box(id, home, {0, 0, 0}), Activity::kAsleep));
  }
  for (const std::uint64_t id : {1, 3, 4}) body(*partition, id).dirty = false;
  body(*partition, 4).next_home = kHigh;
  retire_sectors(*partition);
  EXPECT_THAT(partition->active, ElementsAre(&sector(*partition, kHigh), &sector(*partition, unknown),
                                             &sector(*partition, on_the_move)));
  EXPECT_FALSE(sector(*partition, at_rest).active);
}

}  // namespace
}  // namespace tessera
