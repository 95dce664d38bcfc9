// A small crowd, whose bits do not depend on who has its sectors.
#include "experiments/scale/crowd.h"

#include <gtest/gtest.h>

#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

TEST(Crowd, HasTheSameBitsByAnyPolicy) {
  const CrowdOptions options{.bodies = 150, .ticks = 60};
  const WorldDescription world = crowd_world(options);
  const auto run = [&](const Sharing& sharing) {
    return run_crowd(world, options.ticks, sharing, [] { return true; });
  };
  const absl::StatusOr<CrowdRun> undisturbed = run({});
  ASSERT_TRUE(undisturbed.ok()) << undisturbed.status();
  EXPECT_EQ(undisturbed->moves, 0u);
  EXPECT_GT(undisturbed->largest_ms, undisturbed->mean_ms);
  for (const BalancePolicy policy : kBalancePolicies) {
    const absl::StatusOr<CrowdRun> other = run({.policy = policy, .every = 0.05, .ahead = 0.5});
    ASSERT_TRUE(other.ok()) << other.status();
    EXPECT_EQ(other->hash, undisturbed->hash) << name_of(policy);
  }
}

// At the speed that the slope and the drag hold.
TEST(Crowd, WalksOn) {
  constexpr double kBall = 1;  // kg
  const absl::StatusOr<std::unique_ptr<Simulation>> simulation =
      Simulation::create(walk_world({.bodies = 100}));
  ASSERT_TRUE(simulation.ok()) << simulation.status();
  for (Tick tick = 0; tick < 1200; ++tick) (*simulation)->step();
  int walkers = 0;
  (*simulation)->for_each_body([&](const BodyRecord& body) {
    if (body.properties.mass != kBall) return;
    const double speed = body.state.linear_velocity[0];
    EXPECT_LT(speed, 1.2);
    walkers += speed > 0.6 ? 1 : 0;
  });
  EXPECT_GE(walkers, 95);
}

TEST(Crowd, EndsWhereItIsToEnd) {
  const CrowdOptions options{.bodies = 20, .ticks = 60};
  EXPECT_TRUE(
      absl::IsCancelled(run_crowd(crowd_world(options), options.ticks, {}, [] { return false; }).status()));
}

}  // namespace
}  // namespace tessera
