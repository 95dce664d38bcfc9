// Commands take effect where the body lives, and what they concern wakes up.
#include "lpss/tick/commands.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
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
  std::vector<Exchange> outbox(1);
  std::vector<Stopped> stopped;
  std::vector<HomeChange> changes = apply_commands(partition, commands, outbox, stopped);
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
  target.state.activity = Activity::kAsleep;  // as of a program whose body stood still
  carried_out(*partition, std::vector<Command>{target});
  EXPECT_THAT(state_of(*partition, 1).linear_velocity, ElementsAre(-32, 0, 0)) << "0.5 m in 1/64 s";
  ASSERT_TRUE(body(*partition, 1).kinematic_target);
  EXPECT_THAT(body(*partition, 1).kinematic_target->position, ElementsAre(0.5, 0, 0)) << "seen from its home";
  EXPECT_EQ(body(*partition, 1).kinematic_target->activity, Activity::kAwake) << "others are told of it";
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
  std::vector<Exchange> outbox(1);
  EXPECT_TRUE(apply_commands(*partition, commands, outbox, stopped).empty());
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

SetProperties with_properties(const BodyRecord& record, const std::function<void(BodyProperties&)>& change) {
  SetProperties command{record.id, record.properties};
  change(command.properties);
  return command;
}

TEST(Commands, AnImpulseFindsTheMassThatACommandBeforeItHasSet) {
  TestPartition partition;
  const BodyRecord record = moving(box(1, kHigh, {1, 2, 3}), {0, 5, 0});
  add_body(*partition, in_state(record, Activity::kWantsSleep));
  settle_down(*partition);
  const std::vector<Command> commands{ApplyForce{BodyId{1}, Wrench{{0, 8, 0}, {}}},
                                      with_properties(record, [](BodyProperties& p) { p.mass = 4; }),
                                      ApplyImpulse{BodyId{1}, {8, 0, 0}, {}}};
  EXPECT_TRUE(carried_out(*partition, commands).empty());
  const HomeBody& changed = body(*partition, 1);
  EXPECT_THAT(state_of(*partition, 1).position, ElementsAre(1, 2, 3));
  EXPECT_THAT(state_of(*partition, 1).linear_velocity, ElementsAre(2, 5, 0));
  EXPECT_EQ(activity_of(*partition, 1), Activity::kAwake);
  EXPECT_EQ(changed.properties.mass, 4);
  EXPECT_THAT(changed.sector->world->total_wrench(changed.slot).force, ElementsAre(0, 8, 0));
  EXPECT_TRUE(changed.dirty);
  EXPECT_THAT(partition->active, ElementsAre(&sector(*partition, kHigh)));
}

TEST(Commands, ABodyThatBecomesKinematicAndBackKeepsItsVelocity) {
  TestPartition partition;
  const BodyRecord record = moving(box(1, kHigh, {1, 2, 3}), {0, 5, 0});
  add_body(*partition, record);
  const Command halt = with_properties(record, [](BodyProperties& p) { p.motion = Motion::kKinematic; });
  const Command release = with_properties(record, [](BodyProperties&) {});
  const auto push = [&] {
    carried_out(*partition, std::vector<Command>{ApplyImpulse{BodyId{1}, {3, 0, 0}, {}}});
    return state_of(*partition, 1).linear_velocity;
  };
  carried_out(*partition, std::vector<Command>{ApplyForce{BodyId{1}, Wrench{{0, 8, 0}, {}}}, halt});
  EXPECT_THAT(sector(*partition, kHigh).kinematics, ElementsAre(&body(*partition, 1)));
  EXPECT_THAT(push(), ElementsAre(0, 5, 0)) << "nothing pushes it";
  carried_out(*partition, std::vector<Command>{release});
  EXPECT_TRUE(sector(*partition, kHigh).kinematics.empty());
  EXPECT_THAT(push(), ElementsAre(3, 5, 0));
  const HomeBody& released = body(*partition, 1);
  EXPECT_THAT(released.sector->world->total_wrench(released.slot).force, ElementsAre(0, 0, 0));
  for (Sector* active : partition->active) active->active = true;
  check_invariants(*partition);
}

TEST(Commands, WhoeverKnowsABodyKnowsItsNewProperties) {
  TestWorld world(2);
  const BodyRecord record = box(2, kHigh, kBehindBorder);
  world.add(box(1, kLow, kBeforeBorder));
  world.add(record);
  world.add(hinge(1, 2, 1));
  world.exchange();
  EXPECT_FALSE(world[0].replicas.at(BodyId{2})->known_everywhere);
  const std::vector<Command> commands{with_properties(record, [](BodyProperties& p) {
    p.motion = Motion::kKinematic;
    p.friction = 0.75;
  })};
  for (const Rank rank : {0u, 1u}) carried_out(world[rank], commands);
  EXPECT_EQ(body(world[1], 2).properties.friction, 0.75);
  const Replica& replica = *world[0].replicas.at(BodyId{2});
  EXPECT_EQ(replica.properties.friction, 0.75);
  EXPECT_EQ(replica.properties.motion, Motion::kKinematic);
  for (const auto& clone : replica.clones) EXPECT_FALSE(clone->is_placed()) << "until its home tells of it";
  for (const Rank rank : {0u, 1u})
    EXPECT_EQ(world[rank].joints.find(JointId{1})->parent_motion, Motion::kKinematic);
  EXPECT_EQ(world[0].joints.record(JointId{1})->parent_motion, Motion::kKinematic);
  world.exchange();
  EXPECT_TRUE(world[0].replicas.at(BodyId{2})->known_everywhere);
}

TEST(Commands, WhatTouchesABodyWakesWithItsProperties) {
  for (const Motion motion : {Motion::kDynamic, Motion::kStatic}) {
    TestWorld world;
    const BodyRecord lower = box(1, kHigh, {0, 0, 0}, motion);
    world.add(lower);
    world.add(box(2, kHigh, {0, 0, 0.984375}));
    world.exchange();
    world.detect();
    body(world[0], 2).sector->world->sleep(body(world[0], 2).slot);
    carried_out(world[0],
                std::vector<Command>{with_properties(lower, [](BodyProperties& p) { p.mask = 0; })});
    EXPECT_EQ(activity_of(world[0], 2), Activity::kAwake);
    world.exchange();
    world.detect();
    EXPECT_TRUE(sector(world[0], kHigh).world->contacts().empty()) << "it collides with nothing any more";
  }
}

TEST(Commands, ARadialImpulseIsTheLessTheFartherABodyIs) {
  TestPartition partition;
  add_body(*partition, in_state(box(1, kHigh, {2, 0, 0}), Activity::kAsleep));
  add_body(*partition, box(2, kHigh, {0, 3, 0}));
  add_body(*partition, box(3, kHigh, {0, 0, 4}));
  add_body(*partition, box(4, kHigh, {0, 0, 0}));
  add_body(*partition, box(5, kHigh, {0, -1, 0}, Motion::kKinematic));
  BodyRecord other = box(6, kHigh, {-1, 0, 0});
  other.properties.category = 2;
  add_body(*partition, other);
  settle_down(*partition);
  const auto velocity = [&](std::uint64_t id) { return state_of(*partition, id).linear_velocity; };
  carried_out(*partition, std::vector<Command>{ApplyRadialImpulse{kHigh, {0, 0, 0}, 4, 8, 1}});
  EXPECT_THAT(velocity(1), ElementsAre(4, 0, 0));
  EXPECT_THAT(velocity(2), ElementsAre(0, 2, 0));
  for (const std::uint64_t id : {3, 4, 5, 6})
    EXPECT_THAT(velocity(id), ElementsAre(0, 0, 0)) << "body " << id;
  EXPECT_EQ(activity_of(*partition, 1), Activity::kAwake);
  EXPECT_TRUE(body(*partition, 1).dirty);
  EXPECT_FALSE(body(*partition, 3).dirty);
  carried_out(*partition, std::vector<Command>{ApplyRadialImpulse{kHigh, {0, 0, 0}, 4, -8, 3}});
  EXPECT_THAT(velocity(1), ElementsAre(0, 0, 0));
  EXPECT_THAT(velocity(6), ElementsAre(6, 0, 0)) << "it pulls";
}

TEST(Commands, ARadialImpulseReachesOverBordersAndFindsWhatWasTeleportedBeforeIt) {
  TestPartition partition;
  add_body(*partition, box(1, kLow, {7, 0, 0}));
  add_body(*partition, box(2, kHigh, {5, 5, 5}));
  add_body(*partition, box(3, kHigh, {-7, 2, 0}));
  Teleport jump{BodyId{2}, kLow, {}};
  jump.state.position = {7, 2, 0};
  Teleport away{BodyId{3}, kHigh, {}};
  away.state.position = {0, 7, 7};
  const std::vector<Command> commands{jump, away, ApplyRadialImpulse{{-1, 1, 0}, {9, -16, 0}, 4, 8, 1}};
  const std::vector<HomeChange> changes = carried_out(*partition, commands);
  EXPECT_THAT(state_of(*partition, 1).linear_velocity, ElementsAre(-4, 0, 0));
  ASSERT_EQ(changes.size(), 2u);
  const double share = 8 * (1 - std::sqrt(8) / 4) / std::sqrt(2);
  EXPECT_NEAR(changes[0].handover.record.state.linear_velocity[0], -share, 1e-6);
  EXPECT_NEAR(changes[0].handover.record.state.linear_velocity[1], share, 1e-6);
  EXPECT_THAT(changes[1].handover.record.state.linear_velocity, ElementsAre(0, 0, 0));
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
