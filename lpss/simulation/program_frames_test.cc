// Characters that walk into frames that move, in them and out of them, without knowing it.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "lpss/model/frame_motion.h"
#include "lpss/simulation/program_scenes.h"

namespace tessera {
namespace {

constexpr double kWalk = 1.5;        // m/s
constexpr double kLeaves = 6;        // s, at which the train does
constexpr double kSpeedsUp = 2;      // s
constexpr double kAcceleration = 1;  // m/s^2

// A train that stands for some seconds and then goes along x, and the platform beside it. Their floors
// overlap at the edge of the train's region, at y = -2.
WorldBuilder station() {
  WorldSettings settings = settings_of(8);
  MovingFrame train;
  train.name = "train";
  train.region = FrameRegion{{0, 0, 2}, {30, 4, 5}};
  train.legs = {{kLeaves, Eigen::Vector3d::Zero()}, {kSpeedsUp, {kAcceleration, 0, 0}}};
  settings.frames = {train};
  WorldBuilder builder(settings);
  add_box(builder, "floor", {30, 5, 1}, {0, 0, -0.5}, Motion::kStatic).pose.position.sector.frame = 1;
  add_box(builder, "platform", {120, 10.5, 1}, {0, -6.75, -0.5}, Motion::kStatic);
  return builder;
}

// m, from the origin of the frame that it is in.
Eigen::Vector3d place_in_its_frame(const BodyRecord& body, const Watched& world) {
  return place_in_frame({body.home, body.state}, world.world().settings.sector_size);
}

// It leans while the train gains speed.
void expect_walks_upright(const Watched& world, const std::string& walker, int tick) {
  const BodyRecord body = world.body(walker);
  ASSERT_EQ(value_of(body, "grounded"), 1) << walker << ", tick " << tick;
  ASSERT_NEAR(place_in_its_frame(body, world).z(), kExampleStanding, 0.02) << walker << ", tick " << tick;
}

TEST(CharacterInFrames, WalksAboardAndRidesAlong) {
  WorldBuilder builder = station();
  add_character(builder, "walker", {1, -5, kExampleStanding}, {{"y", kWalk}});
  Watched world(builder);
  world.run(1);
  bool was_outside = true;
  int crossings = 0;
  for (int tick = 60; tick < 180; ++tick) {
    world.step();
    expect_walks_upright(world, "walker", tick);
    ASSERT_NEAR(world.velocity("walker").y(), kWalk, 1e-3) << tick;
    const bool is_outside = world.body("walker").home.frame == kWorldFrame;
    crossings += is_outside != was_outside ? 1 : 0;
    was_outside = is_outside;
  }
  EXPECT_FALSE(was_outside);
  EXPECT_EQ(crossings, 1);
  world.tell("walker", "y", 0);
  world.run(1);
  const Eigen::Vector3d stands = place_in_its_frame(world.body("walker"), world);
  for (int tick = 0; tick < 420; ++tick) {
    world.step();
    expect_walks_upright(world, "walker", tick);
  }
  EXPECT_LT((place_in_its_frame(world.body("walker"), world) - stands).norm(), 0.01) << "the train has left";
  // Aboard, it walks as on the ground.
  world.tell("walker", "x", kWalk);
  world.run(1);
  EXPECT_NEAR(world.velocity("walker").x(), kWalk, 1e-3);
}

// From the train that goes at 2 m/s onto the platform, where it soon walks straight on.
TEST(CharacterInFrames, WalksOffWhatMovesAndOnTheGround) {
  WorldBuilder builder = station();
  add_character(builder, "walker", {-5, 1, kExampleStanding}).pose.position.sector.frame = 1;
  Watched world(builder);
  world.run(kLeaves + kSpeedsUp);
  ASSERT_EQ(world.body("walker").home.frame, 1u);
  world.tell("walker", "y", -kWalk);
  int outside = 0;  // ticks
  for (int tick = 0; tick < 240; ++tick) {
    world.step();
    expect_walks_upright(world, "walker", tick);
    outside += world.body("walker").home.frame == kWorldFrame ? 1 : 0;
    if (outside == 1) {
      EXPECT_NEAR(world.velocity("walker").x(), kSpeedsUp * kAcceleration, 0.05) << "it comes with the train";
    }
  }
  EXPECT_GT(outside, 60);
  EXPECT_NEAR(world.velocity("walker").x(), 0, 1e-3);
  EXPECT_NEAR(world.velocity("walker").y(), -kWalk, 1e-3);
}

// It neither takes along who stands at the edge, nor leaves who is aboard.
TEST(CharacterInFrames, AFastTrainDoesNotSweepUpWhoStandsAtTheEdge) {
  WorldBuilder builder = station();
  builder.world().settings.frames.front().start.position = *canonical({}, {-60, 0, 0}, 8);
  builder.world().settings.frames.front().velocity = {20, 0, 0};
  add_character(builder, "waits", {1, -1.7, kExampleStanding});
  add_character(builder, "rides", {2, -1.7, kExampleStanding}).pose.position.sector.frame = 1;
  Watched world(builder);
  const Eigen::Vector3d waits = world.position("waits");
  for (int tick = 0; tick < 300; ++tick) {
    world.step();
    ASSERT_EQ(world.body("waits").home.frame, kWorldFrame) << tick;
    ASSERT_EQ(world.body("rides").home.frame, 1u) << tick;
    expect_walks_upright(world, "rides", tick);
  }
  EXPECT_LT((world.position("waits") - waits).norm(), 0.01);
}

TEST(CharacterInFrames, BitsDoNotDependOnPartitions) {
  WorldBuilder builder = station();
  for (int n = 0; n < 4; ++n)
    add_character(builder, "boards" + std::to_string(n), {3.0 * n - 6, -4.0 - n, kExampleStanding},
                  {{"x", 0.2 * n}, {"y", kWalk}});
  for (int n = 0; n < 3; ++n)
    add_character(builder, "leaves" + std::to_string(n), {4.0 * n - 5, 1, kExampleStanding},
                  {{"x", -0.2 * n}, {"y", -kWalk}})
        .pose.position.sector.frame = 1;
  const auto alone = cluster_of(builder.world(), 1);
  expect_the_same_on_any_partitions(builder.world(), hashes_of(*alone, 500));
}

}  // namespace
}  // namespace tessera
