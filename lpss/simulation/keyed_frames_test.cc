// Frames that follow keys, whose acceleration changes within each tick.
#include <gtest/gtest.h>

#include <vector>

#include "lpss/base/rotation.h"
#include "lpss/model/frame_keys.h"
#include "lpss/simulation/frame_scenes.h"

namespace tessera {
namespace {

using Eigen::Vector3d;
using namespace frame_scenes;

// It waits for two seconds, and goes round.
MovingFrame gondola() {
  MovingFrame frame = frame_at(Vector3d::Zero());
  frame.loops = true;
  const Vector3d still = Vector3d::Zero();
  frame.keys = {{0, {}, still, still},
                {2, {}, still, still},
                {4, {{6, -2, 3}, rotation_by({0.2, 0, 1})}, {}, {}},
                {6, {{2, 5, 6}, rotation_by({0, -0.3, 2.5})}, {}, {}},
                {8, {}, {}, {}}};
  smooth_keys(frame.keys, frame.loops);
  return frame;
}

TEST(KeyedFrames, BitsDoNotDependOnServersOrPlace) {
  constexpr int kTicks = 300;
  WorldDescription world = aboard(gondola(), pile_world(settings_of(8), 30));
  const std::vector<WorldHash> one = hashes_of(world, 1, kTicks);
  EXPECT_EQ(first_difference(one, hashes_of(world, 3, kTicks)), one.size());
  ASSERT_TRUE(move_by(world, {std::int64_t{1} << 61, -(std::int64_t{1} << 61), 7}).ok());
  EXPECT_EQ(first_difference(one, hashes_of(world, 2, kTicks)), one.size());
}

TEST(KeyedFrames, WhatFliesGoesOnAParabolaOutside) {
  WorldBuilder builder(settings_of(16));
  builder.add("ball", builder.shape(Sphere{0.2}), 1, {2, -3, 10}).linear_velocity = {1, 2, 12};
  const WorldDescription world = aboard(gondola(), builder.world());
  const auto simulation = simulation_of(world);
  const auto seen = [&] { return outside(*simulation, body_of(*simulation, 1)); };
  run_for(*simulation, 2);
  const double size = world.settings.sector_size;
  const FramedBody start = seen();
  const Vector3d velocity(start.state.linear_velocity.data());
  constexpr double kSeconds = 3;
  run_for(*simulation, kSeconds);
  const FramedBody end = seen();
  const Vector3d way = metres_between(start.home, end.home, size) +
                       (Vector3d(end.state.position.data()) - Vector3d(start.state.position.data()));
  const Vector3d right = velocity * kSeconds - Vector3d(0, 0, kPull / 2 * kSeconds * kSeconds);
  const bool is_fine = world.settings.precision == Precision::kFloat64;
  EXPECT_LT((way - right).norm(), is_fine ? 1e-9 : 1e-3);
  EXPECT_LT((Vector3d(end.state.linear_velocity.data()) - velocity + Vector3d(0, 0, kPull * kSeconds)).norm(),
            is_fine ? 1e-9 : 1e-3);
}

// As a lift starts and stops.
TEST(KeyedFrames, WhatStandsInALiftIsPressedAndRelievedAndSleepsAtTheTop) {
  MovingFrame lift = frame_at(Vector3d::Zero());
  lift.keys = {{0, {}, {}, {}}, {4, {{0, 0, 16}, {}}, {}, {}}};
  smooth_keys(lift.keys, lift.loops);
  WorldBuilder builder(settings_of(16));
  builder.add_floor(10, 0);
  builder.add("box", builder.shape(Box{{1, 1, 1}}), 10, {0, 0, 0.5});
  const auto simulation = simulation_of(aboard(lift, builder.world()));
  EXPECT_NEAR(simulation->partition().felt[1].at({0, 0, 0, 1}, Vector3d::Zero(), true).z(), -kPull - 6, 0.05);
  run_for(*simulation, 3.9);
  EXPECT_EQ(asleep(*simulation), 0);
  EXPECT_NEAR(simulation->partition().felt[1].at({0, 0, 0, 1}, Vector3d::Zero(), true).z(), -kPull + 6 * 0.95,
              0.05);
  run_for(*simulation, 2);
  EXPECT_EQ(asleep(*simulation), 1);
  EXPECT_NEAR(place_of(*simulation, body_of(*simulation, 2)).z(), 0.5, 1e-3);
}

TEST(KeyedFrames, WhatLeavesOneGoesOnAsItWasSeen) {
  MovingFrame frame = gondola();
  frame.region = FrameRegion{{0, 0, 0}, {4, 4, 4}};
  WorldBuilder builder(settings_of(16, Vector3d::Zero()));
  builder.add("ball", builder.shape(Sphere{0.2}), 1, {0, 0, 0}).linear_velocity = {0.4, 0.1, 0};
  const auto simulation = simulation_of(aboard(frame, builder.world()));
  const Vector3d start = seen_from_outside(*simulation, body_of(*simulation, 1));
  run_for(*simulation, 4.5);
  const BodyRecord ball = body_of(*simulation, 1);
  EXPECT_EQ(ball.home.frame, kWorldFrame);
  EXPECT_LT((Vector3d(ball.state.linear_velocity.data()) - Vector3d(0.4, 0.1, 0)).norm(), 1e-4);
  EXPECT_LT((seen_from_outside(*simulation, ball) - start - Vector3d(1.8, 0.45, 0)).norm(), 1e-3);
}

}  // namespace
}  // namespace tessera
