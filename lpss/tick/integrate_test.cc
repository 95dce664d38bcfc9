// Velocities become motion.
#include "lpss/tick/integrate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "lpss/model/limits.h"
#include "lpss/tick/commands.h"
#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::IsEmpty;

// A tick in which nothing is solved.
std::vector<Stopped> detect_and_integrate(TestWorld& world) {
  world.exchange();
  world.detect();
  return integrate(world[0], world.contexts[0].stepped, {});
}

TEST(Integrate, BodiesGoAsFarAsTheirVelocitiesSay) {
  TestWorld world;
  world.add(moving(box(1, kHigh, {1, 2, 3}), {64, -32, 0}));
  world.add(moving(box(2, kLow, {1, 2, 3}, Motion::kKinematic), {0, 0, 16}));
  EXPECT_THAT(detect_and_integrate(world), IsEmpty());
  EXPECT_THAT(world.state(1).position, ElementsAre(2, 1.5, 3));
  EXPECT_THAT(world.state(2).position, ElementsAre(1, 2, 3.25));
}

TEST(Integrate, AKinematicBodyArrivesAtItsTargetAndThenSleeps) {
  TestWorld world;
  world.add(box(1, kHigh, {0, 0, 0}, Motion::kKinematic));
  HomeBody& moved = body(world[0], 1);
  moved.kinematic_target = BodyState{};
  moved.kinematic_target->position = {1, 2, 3};
  detect_and_integrate(world);
  EXPECT_THAT(world.state(1).position, ElementsAre(1, 2, 3));
  EXPECT_EQ(world.state(1).activity, Activity::kAwake);
  EXPECT_FALSE(moved.dirty);
  std::vector<Stopped> stopped;
  std::vector<Exchange> outbox(1);
  apply_commands(world[0], {}, outbox, stopped);
  EXPECT_FALSE(moved.kinematic_target);
  detect_and_integrate(world);
  EXPECT_EQ(world.state(1).activity, Activity::kAsleep);
  EXPECT_TRUE(moved.dirty) << "others have to hear of it";
}

// With a rotation that is not the identity, so that it can be lost.
BodyRecord turned(BodyRecord record) {
  record.state.rotation = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  return record;
}

TEST(Integrate, ABodyThatDivergesStopsWhereItWas) {
  TestWorld world;
  world.add(turned(moving(box(1, kHigh, {0, 0, 0}), {2 * kSpeedMax, 0, 0})));
  world.add(turned(moving(box(2, kLow, {1, 2, 3}), {1, 0, 0})));
  world.exchange();
  world.detect();
  const HomeBody& lost = body(world[0], 2);
  lost.sector->world->set_velocity(lost.slot, {0, std::numeric_limits<double>::infinity(), 0}, {0, 0, 0});
  const std::vector<Stopped> stopped = integrate(world[0], world.contexts[0].stepped, {});
  ASSERT_EQ(stopped.size(), 2u);
  for (const auto& [id, kind] : stopped)
    EXPECT_EQ(kind, id == BodyId{1} ? DivergenceKind::kSpeed : DivergenceKind::kVelocity);
  EXPECT_THAT(world.state(1).position, ElementsAre(0, 0, 0));
  EXPECT_THAT(world.state(2).position, ElementsAre(1, 2, 3));
  for (const std::uint64_t id : {1, 2}) {
    EXPECT_THAT(world.state(id).linear_velocity, Each(0));
    EXPECT_THAT(world.state(id).rotation, ElementsAre(0, -1, 0, 1, 0, 0, 0, 0, 1));
    EXPECT_EQ(world.state(id).activity, Activity::kAwake);
  }
}

// As the solver of its island leaves it, here or on another server.
TEST(Integrate, ABodyWhoseJointsGainEnergyStopsWhereItWas) {
  TestWorld world;
  world.add(turned(moving(box(1, kLow, {1, 2, 3}), {1, 0, 0})));
  world.exchange();
  world.detect();
  const HomeBody& body_1 = body(world[0], 1);
  BodyState solved = world.state(1);
  const Eigen::Vector3d gained = velocity_of_gained_energy();
  solved.linear_velocity = solved.angular_velocity = {gained.x(), gained.y(), gained.z()};
  body_1.sector->world->set_state(body_1.slot, solved);
  const std::vector<Stopped> stopped = integrate(world[0], world.contexts[0].stepped, {});
  ASSERT_EQ(stopped.size(), 1u);
  EXPECT_EQ(stopped[0].kind, DivergenceKind::kEnergy);
  EXPECT_THAT(world.state(1).position, ElementsAre(1, 2, 3));
  EXPECT_THAT(world.state(1).linear_velocity, Each(0));
}

}  // namespace
}  // namespace tessera
