// Frames that follow keys, whose acceleration changes within each tick, and frames in those that bodies
// carry.
#include <gtest/gtest.h>

#include <functional>
#include <string>
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

void add_cube(WorldBuilder& builder, const Vector3d& place = Vector3d::Zero()) {
  const std::string name = "cube" + std::to_string(builder.world().bodies.size());
  builder.add(name, builder.shape(Box{{1, 1, 1}}), 10, place);
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
  lift.keys = {{0, {}, {}, {}}, {4, {{0, 0, 16}, Eigen::Quaterniond::Identity()}, {}, {}}};
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

// --- in a frame that a body carries ---

// A hull, its frame, and a table aboard, which is a frame in that one; what `fill` adds is on the table.
WorldDescription with_table(const Vector3d& spin_of_hull, const Vector3d& spin_of_table,
                            const std::function<void(WorldBuilder&)>& fill) {
  WorldBuilder hull(settings_of(16, Vector3d::Zero()));
  BodyDescription& body = hull.add("hull", hull.shape(Box{{2, 2, 2}}), 1e5, {3, -2, 50});
  body.linear_velocity = {20, 1, 0};
  body.angular_velocity = spin_of_hull;
  MovingFrame deck;
  deck.name = "deck";
  deck.carrier = FrameCarrier{BodyId{1}, {{0, 0, 1}, Eigen::Quaterniond::Identity()}};
  MovingFrame table;
  table.name = "table";
  table.start = {{{0, 0, 0, 1}, {2, 1, 0}}, rotation_by({0, 0, 0.5})};
  table.spin = spin_of_table;
  WorldBuilder aboard(settings_of(16));
  fill(aboard);
  WorldDescription contents = aboard.world();
  for (BodyDescription& thing : contents.bodies) thing.pose.position.sector.frame = 2;
  WorldDescription world = hull.world();
  world.settings.frames = {deck, table};
  add_all(contents, world);
  place_carried(world);
  return world;
}

TEST(FramesInCarriedOnes, WhatFliesGoesStraightOutside) {
  const auto simulation = simulation_of(with_table({0, 0, 0.2}, {0.4, 0, 0}, [](WorldBuilder& builder) {
    builder.add("ball", builder.shape(Sphere{0.2}), 1, {1, 0, 2}).linear_velocity = {0.5, 1, 0};
  }));
  simulation->step();
  const auto seen = [&] { return seen_from_outside(*simulation, body_of(*simulation, 2)); };
  const Vector3d start = seen();
  const FramedBody ball = outside(*simulation, body_of(*simulation, 2));
  run_for(*simulation, 4);
  const Vector3d right = start + 4 * Vector3d(ball.state.linear_velocity.data());
  EXPECT_LT((seen() - right).norm(), 5e-3);
}

TEST(FramesInCarriedOnes, WhatIsFeltOnATableThatStandsIsThatOfTheDeck) {
  const WorldDescription world =
      with_table({0, 0.1, 0.2}, Vector3d::Zero(), [](WorldBuilder& builder) { add_cube(builder); });
  const auto simulation = simulation_of(world);
  ApplyForce thrust{BodyId{1}, {}};
  thrust.wrench.force = {3e5, 0, 1e5};
  const std::vector<Command> commands = {thrust};
  for (int tick = 0; tick < 60; ++tick) simulation->step(commands);
  const std::vector<Felt>& felt = simulation->partition().felt;
  const Vector3d on_deck = felt[1].at({0, 0, 0, 1}, {2, 1, 0}, true);
  const Vector3d on_table = felt[2].at({0, 0, 0, 2}, Vector3d::Zero(), true);
  EXPECT_GT(on_deck.norm(), 2);
  EXPECT_LT((rotation_by({0, 0, 0.5}) * on_table - on_deck).norm(), 1e-6);
}

TEST(FramesInCarriedOnes, BitsDoNotDependOnServers) {
  const WorldDescription world = with_table({0, 0.1, 0.2}, {0.3, 0, 1}, [](WorldBuilder& builder) {
    builder.add_floor(6, 0);
    for (int n = 0; n < 6; ++n) add_cube(builder, {1.2 * n - 3, 0, 0.6});
  });
  const std::vector<WorldHash> one = hashes_of(world, 1, 200);
  EXPECT_EQ(first_difference(one, hashes_of(world, 3, 200)), one.size());
}

}  // namespace
}  // namespace tessera
