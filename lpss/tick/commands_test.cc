// Commands take effect where the body lives, and what they concern wakes up.
#include "lpss/tick/commands.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <span>
#include <vector>

#include "lpss/model/limits.h"
#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

using testing::ElementsAre;

// As it is once everyone knows it, at the end of a tick.
void settle_down(Partition& partition) {
  for (auto& [id, body] : partition.bodies) body->dirty = false;
  for (Sector* sector : partition.active) sector->active = false;
  partition.active.clear();
}

// Of commands that stop no body.
std::vector<HomeChange> carried_out(Partition& partition, std::span<const Command> commands) {
  std::vector<Stopped> stopped;
  std::vector<HomeChange> changes = apply_commands(partition, commands, stopped);
  EXPECT_TRUE(stopped.empty());
  return changes;
}

TEST(Commands, AVelocityWakesItsBodyAndPutsTheSectorOnTheList) {
  TestPartition partition;
  add_body(*partition, in_state(box(1, kHigh, {0, 0, 0}), Activity::kAsleep));
  settle_down(*partition);
  const std::vector<Command> commands{SetVelocity{BodyId{1}, {1, 2, 3}, {4, 5, 6}}, SetVelocity{BodyId{2}}};
  EXPECT_TRUE(carried_out(*partition, commands).empty());
  const BodyState state = state_of(*partition, 1);
  EXPECT_THAT(state.linear_velocity, ElementsAre(1, 2, 3));
  EXPECT_THAT(state.angular_velocity, ElementsAre(4, 5, 6));
  EXPECT_EQ(state.activity, Activity::kAwake);
  EXPECT_TRUE(body(*partition, 1).dirty);
  EXPECT_THAT(partition->active, ElementsAre(&sector(*partition, kHigh)));
}

TEST(Commands, ATeleportTakesTheBodyOutAndHandsItToTheChangeOfHomes) {
  TestPartition partition;
  add_body(*partition, moving(box(1, kLow, {1, 1, 1}), {7, 0, 0}));
  Teleport jump{BodyId{1}, kHigh, {}};
  jump.state.position = {2, 3, 4};
  jump.state.linear_velocity = {9, 9, 9};
  jump.keeps_linear_velocity = true;
  const std::vector<HomeChange> changes = carried_out(*partition, std::vector<Command>{jump});
  ASSERT_EQ(changes.size(), 1u);
  EXPECT_EQ(changes[0].old_home, kLow);
  EXPECT_EQ(changes[0].handover.record.home, kHigh);
  EXPECT_THAT(changes[0].handover.record.state.position, ElementsAre(2, 3, 4));
  EXPECT_THAT(changes[0].handover.record.state.linear_velocity, ElementsAre(7, 0, 0));
  EXPECT_TRUE(partition->bodies.empty());
}

TEST(Commands, TheLastTeleportOfATickCountsAndOthersFindTheBody) {
  TestPartition partition;
  add_body(*partition, moving(box(1, kLow, {1, 1, 1}), {7, 0, 0}));
  Teleport first{BodyId{1}, kLow, {}};
  first.state.linear_velocity = {0, 0, 5};
  first.keeps_rotation = true;
  Teleport last{BodyId{1}, kHigh, {}};
  last.state.position = {2, 3, 4};
  last.keeps_linear_velocity = last.keeps_rotation = true;
  const std::vector<Command> commands{first, ApplyForce{BodyId{1}, Wrench{{0, 8, 0}, {}}},
                                      ApplyImpulse{BodyId{1}, {1, 0, 0}, {}}, last};
  const std::vector<HomeChange> changes = carried_out(*partition, commands);
  ASSERT_EQ(changes.size(), 1u);
  const Handover& handover = changes[0].handover;
  EXPECT_EQ(handover.record.home, kHigh);
  EXPECT_THAT(handover.record.state.position, ElementsAre(2, 3, 4));
  EXPECT_THAT(handover.record.state.linear_velocity, ElementsAre(1, 0, 5));
  EXPECT_THAT(handover.wrench.force, ElementsAre(0, 8, 0));
}

TEST(Commands, ABodyThatIsTeleportedAndRemovedIsGone) {
  TestPartition partition;
  add_body(*partition, box(1, kLow, {1, 1, 1}));
  const std::vector<Command> commands{Teleport{BodyId{1}, kHigh, {}}, RemoveBody{BodyId{1}}};
  EXPECT_TRUE(carried_out(*partition, commands).empty());
  EXPECT_TRUE(partition->bodies.empty());
}

TEST(Commands, ATargetAfterATeleportIsReachedFromWhereTheBodyLands) {
  TestPartition partition;
  add_body(*partition, box(1, kLow, {1, 0, 0}, Motion::kKinematic));
  Teleport jump{BodyId{1}, kHigh, {}};
  jump.state.position = {2, 0, 0};
  KinematicTarget target{BodyId{1}, kHigh, {}};
  target.state.position = {2.5, 0, 0};
  const std::vector<HomeChange> changes = carried_out(*partition, std::vector<Command>{jump, target});
  ASSERT_EQ(changes.size(), 1u);
  const Handover& handover = changes[0].handover;
  EXPECT_THAT(handover.record.state.position, ElementsAre(2, 0, 0));
  EXPECT_THAT(handover.record.state.linear_velocity, ElementsAre(32, 0, 0)) << "0.5 m in 1/64 s";
  ASSERT_TRUE(handover.kinematic_target);
  EXPECT_THAT(handover.kinematic_target->position, ElementsAre(2.5, 0, 0));
}

TEST(Commands, WhatRestsOnABodyThatIsRemovedWakesUp) {
  TestWorld world;
  world.add(box(1, kHigh, {0, 0, 0}));
  world.add(box(2, kHigh, {0, 0, 0.984375}));
  world.add(box(3, kHigh, {5, 0, 0}));
  world.exchange();
  world.detect();
  for (const std::uint64_t id : {1, 2, 3}) {
    body(world[0], id).sector->world->sleep(body(world[0], id).slot);
  }
  carried_out(world[0], std::vector<Command>{RemoveBody{BodyId{1}}});
  EXPECT_FALSE(world[0].bodies.contains(BodyId{1}));
  EXPECT_EQ(activity_of(world[0], 2), Activity::kAwake);
  EXPECT_EQ(activity_of(world[0], 3), Activity::kAsleep);
}

TEST(Commands, AKinematicTargetIsReachedInOneTick) {
  TestPartition partition;
  add_body(*partition, box(1, kHigh, {1, 0, 0}, Motion::kKinematic));
  KinematicTarget target{BodyId{1}, kLow, {}};
  target.state.position = {16.5, 0, 0};
  carried_out(*partition, std::vector<Command>{target});
  EXPECT_THAT(state_of(*partition, 1).linear_velocity, ElementsAre(-32, 0, 0)) << "0.5 m in 1/64 s";
  ASSERT_TRUE(body(*partition, 1).kinematic_target);
  EXPECT_THAT(body(*partition, 1).kinematic_target->position, ElementsAre(0.5, 0, 0)) << "seen from its home";
}

TEST(Commands, NoneTakesABodyOutOfAllRange) {
  TestPartition partition;
  BodyRecord light = box(1, kHigh, {1, 2, 3});
  light.properties.mass = kMassMin;
  add_body(*partition, light);
  add_body(*partition, box(2, kHigh, {5, 2, 3}, Motion::kKinematic));
  ApplyForce push{BodyId{1}, {}};
  push.wrench.force = {0, kForceMax, 0};
  KinematicTarget far{BodyId{2}, {kHigh.i, kHigh.j, std::int64_t{1} << 60}, {}};
  const std::vector<Command> commands{ApplyImpulse{BodyId{1}, {kImpulseMax, 0, 0}, {0, kLeverMax, 0}}, push,
                                      far};
  std::vector<Stopped> stopped;
  EXPECT_TRUE(apply_commands(*partition, commands, stopped).empty());
  ASSERT_EQ(stopped.size(), 3u);
  for (const std::size_t n : {0u, 1u, 2u}) {
    EXPECT_EQ(stopped[n].body, BodyId{n < 2 ? 1u : 2u});
    EXPECT_EQ(stopped[n].kind, DivergenceKind::kSpeed);
  }
  const HomeBody& pushed = body(*partition, 1);
  EXPECT_THAT(state_of(*partition, 1).position, ElementsAre(1, 2, 3));
  EXPECT_THAT(state_of(*partition, 1).linear_velocity, ElementsAre(0, 0, 0));
  EXPECT_THAT(pushed.sector->world->total_wrench(pushed.slot).force, ElementsAre(0, 0, 0));
  EXPECT_FALSE(body(*partition, 2).kinematic_target);
  EXPECT_THAT(state_of(*partition, 2).position, ElementsAre(5, 2, 3));
}

TEST(Commands, ALargerBodyMakesEveryoneLookAgain) {
  TestPartition partition;
  add_body(*partition, in_state(box(1, kLow, {0, 0, 0}), Activity::kAsleep));
  settle_down(*partition);
  const double reach = partition->margins.reach;
  BodyRecord larger = box(2, kHigh, {0, 0, 0});
  larger.properties.shape = 3;
  add_shape(*partition, 3, std::make_shared<const Shape>(Shape{{ShapePart{Sphere{2}, {}}}}));
  carried_out(*partition, std::vector<Command>{SpawnBody{box(3, kHigh, {5, 0, 0})}});
  EXPECT_FALSE(body(*partition, 1).dirty);
  carried_out(*partition, std::vector<Command>{SpawnBody{larger}});
  EXPECT_TRUE(body(*partition, 1).dirty);
  EXPECT_TRUE(sector(*partition, kLow).active);
  EXPECT_GT(partition->margins.reach, reach);
}

}  // namespace
}  // namespace tessera
