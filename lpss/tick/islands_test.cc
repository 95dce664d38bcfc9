// Islands over all sectors, each with one solver that all servers agree on.
#include "lpss/tick/islands.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

void add_pair_over_the_border(TestWorld& world) {
  world.add(box(1, kLow, kBeforeBorder));
  world.add(box(2, kHigh, kBehindBorder));
}

void run_to_planned(TestWorld& world) {
  world.exchange();
  world.detect();
  world.connect();
  world.plan();
}

TEST(Islands, AreSolvedWhereMostOfTheirContactsAreAndTheOthersShip) {
  TestWorld world(2);
  add_pair_over_the_border(world);
  run_to_planned(world);
  const IslandPlan& solver = world.contexts[0].plan;
  ASSERT_EQ(solver.pending.size(), 1u);
  EXPECT_EQ(solver.pending[0].id, BodyId{1});
  EXPECT_THAT(solver.awaits_shipment, ElementsAre(false, true));
  EXPECT_THAT(solver.awaits_solution, ElementsAre(false, false));
  EXPECT_EQ(world.contexts[0].counts.islands_shipped, 1u);

  const IslandPlan& other = world.contexts[1].plan;
  EXPECT_THAT(other.pending, IsEmpty());
  EXPECT_THAT(other.jobs, IsEmpty());
  EXPECT_THAT(other.awaits_solution, ElementsAre(true, false));
  ASSERT_EQ(world.shipments[1][0].islands.size(), 1u);
  EXPECT_EQ(world.shipments[1][0].islands[0].island, BodyId{1});
  EXPECT_EQ(world.shipments[1][0].islands[0].bodies.at(0).id, BodyId{2});
  EXPECT_THAT(world.shipments[0][1].islands, IsEmpty());
}

TEST(Islands, OverSectorsOfOneServerAreOneJob) {
  TestWorld world;
  add_pair_over_the_border(world);
  run_to_planned(world);
  const IslandPlan& plan = world.contexts[0].plan;
  ASSERT_EQ(plan.jobs.size(), 1u);
  EXPECT_EQ(plan.jobs[0].task.bodies.size(), 2u);
  ASSERT_EQ(plan.jobs[0].task.contacts.size(), 1u);
  EXPECT_EQ(plan.jobs[0].task.contacts[0].a, 0u);
  EXPECT_EQ(plan.jobs[0].task.contacts[0].b, 1u) << "the clone stands for its original";
  EXPECT_EQ(plan.jobs[0].task.islands.size(), 1u);
  EXPECT_EQ(world.contexts[0].counts.islands_across_seams, 1u);
  EXPECT_EQ(world.contexts[0].counts.islands_shipped, 0u);
}

TEST(Islands, SmallOnesShareAJobWhateverTheirSectors) {
  TestWorld world;
  add_pair_over_the_border(world);
  for (const auto& [first, home] : {std::pair(3, kLow), {5, kHigh}}) {
    world.add(box(first, home, {0, 0, 0}));
    world.add(box(first + 1, home, {0, 0, 0.984375}));
  }
  run_to_planned(world);
  const IslandPlan& plan = world.contexts[0].plan;
  ASSERT_EQ(plan.jobs.size(), 1u);
  EXPECT_EQ(plan.jobs[0].task.bodies.size(), 6u);
  EXPECT_EQ(plan.jobs[0].task.contacts.size(), 3u);
  EXPECT_EQ(plan.jobs[0].task.islands.size(), 3u);
  EXPECT_EQ(world.contexts[0].counts.islands_across_seams, 1u);
}

TEST(Islands, ABodyThatNothingTouchesNeedsNoSolver) {
  TestWorld world;
  world.add(box(1, kHigh, {0, 0, 0}));
  world.add(box(2, kHigh, {0, 0, 0.984375}));
  world.add(box(3, kHigh, {5, 0, 0}));
  run_to_planned(world);
  EXPECT_THAT(world.sector(kHigh).in_free_flight, ElementsAre(body(world[0], 3).slot));
  ASSERT_EQ(world.contexts[0].plan.jobs.size(), 1u);
  EXPECT_EQ(world.contexts[0].plan.jobs[0].task.bodies.size(), 2u);
}

TEST(Islands, AllServersDrawTheSameSolverWhileAuthorityIsShuffled) {
  WorldSettings settings = test_settings();
  settings.shuffle = 7;
  std::array<int, 2> solved{};
  for (Tick tick = 1; tick <= 32; ++tick) {
    TestWorld world(2, settings);
    for (TickContext& context : world.contexts) context.tick = tick;
    add_pair_over_the_border(world);
    run_to_planned(world);
    ASSERT_EQ(world.contexts[0].plan.staged.empty(), world.contexts[1].plan.staged.empty());
    if (!world.contexts[0].plan.staged.empty()) continue;
    const Rank solver = world.contexts[0].plan.pending.empty() ? 1 : 0;
    const Rank other = 1 - solver;
    EXPECT_EQ(world.contexts[solver].plan.pending.size(), 1u);
    EXPECT_THAT(world.contexts[other].plan.pending, IsEmpty());
    EXPECT_EQ(world.shipments[other][solver].islands.size(), 1u);
    ++solved[solver];
  }
  EXPECT_GT(solved[0], 0);
  EXPECT_GT(solved[1], 0);
}

}  // namespace
}  // namespace tessera
