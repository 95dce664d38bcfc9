// Islands beyond the cap are solved in parts that agree on the bodies that they share.
#include "lpss/tick/couple.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

using testing::ElementsAre;

WorldSettings capped(std::uint32_t cap) {
  WorldSettings settings = test_settings();
  settings.island_cap = cap;
  return settings;
}

// Two boxes that meet at the border.
void add_crash(TestWorld& world) {
  world.add(moving(box(1, kLow, kBeforeBorder), {1, 0, 0}));
  world.add(moving(box(2, kHigh, kBehindBorder), {-1, 0, 0}));
}

void run_to_planned(TestWorld& world) {
  world.exchange();
  world.detect();
  world.connect();
  world.plan();
}

TEST(Couple, OnlyIslandsOfMoreBodiesThanTheCapAreCut) {
  for (const std::uint32_t cap : {1, 2}) {
    TestWorld world(2, capped(cap));
    add_crash(world);
    run_to_planned(world);
    EXPECT_EQ(world.contexts[0].counts.islands_cut, cap == 1 ? 1u : 0u);
    EXPECT_EQ(world.contexts[1].counts.islands_cut, 0u) << "it is counted once";
    for (const TickContext& context : world.contexts) {
      EXPECT_EQ(context.plan.coupled.size(), cap == 1 ? 1u : 0u);
    }
  }
}

TEST(Couple, APartKnowsWithWhomItSharesWhichBody) {
  TestWorld world(2, capped(1));
  add_crash(world);
  run_to_planned(world);
  for (const TickContext& context : world.contexts) {
    EXPECT_THAT(context.plan.coupled_with, ElementsAre(true, true));
    const CoupledPart& part = context.plan.coupled.at(0);
    ASSERT_EQ(part.shared.size(), 1u);
    EXPECT_EQ(part.shared[0].id, BodyId{2});
    EXPECT_EQ(part.shared[0].ranks, 0b11u);
  }
  ASSERT_EQ(world.shipments[1][0].shared.size(), 1u) << "the home tells the copy how the body is";
  EXPECT_EQ(world.shipments[1][0].shared[0].record.id, BodyId{2});
}

TEST(Couple, PartsOnTwoServersComeOutAsOnOneAndNoImpulseIsLost) {
  TestWorld alone(1, capped(1));
  TestWorld shared(2, capped(1));
  for (TestWorld* world : {&alone, &shared}) {
    add_crash(*world);
    world->run_to_solved();
  }
  for (const std::uint64_t id : {1, 2}) {
    EXPECT_EQ(bits(shared.state(id)), bits(alone.state(id))) << "body " << id;
  }
  EXPECT_NEAR(alone.state(1).linear_velocity[0] + alone.state(2).linear_velocity[0], 0, 1e-5);
  EXPECT_LE(alone.state(1).linear_velocity[0], 0.01) << "they no longer approach each other";
}

// The parent of a joint lives in the other part, which has no clone of it.
TEST(Couple, APartCopiesTheBodiesThatOnlyJointsReach) {
  WorldSettings settings = capped(1);
  settings.gravity = UniformGravity{};
  TestWorld alone(1, settings);
  TestWorld shared(2, settings);
  for (TestWorld* world : {&alone, &shared}) {
    world->add(moving(box(1, kLow, {7.5, 0, 0}), {0, 1, 0}));
    world->add(moving(box(2, kHigh, {-7.5, 0, 0}), {0, -1, 0}));
    world->add(hinge(1, 1, 2));
    run_to_planned(*world);
    world->solve();
  }
  for (const std::uint64_t id : {1, 2}) {
    EXPECT_EQ(bits(shared.state(id)), bits(alone.state(id))) << "body " << id;
    EXPECT_NEAR(alone.state(id).linear_velocity[2], -9.81 / 64, 1e-4) << "both fall freely";
  }
  EXPECT_TRUE(shared.contexts[1].plan.coupled.at(0).copies) << "of the parent, which is not cloned upwards";
  EXPECT_NEAR(alone.state(1).linear_velocity[1], 0.6, 1e-3) << "they turn as one body";
}

}  // namespace
}  // namespace tessera
