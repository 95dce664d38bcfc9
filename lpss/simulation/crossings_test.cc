// Bodies that come into frames that move, and leave them: with all that they touch or are joined to, and as
// mechanics has it, seen from outside.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "lpss/base/rotation.h"
#include "lpss/model/frame_motion.h"
#include "lpss/simulation/example_programs.h"
#include "lpss/simulation/frame_scenes.h"

namespace tessera {
namespace {

using Eigen::Vector3d;
using namespace frame_scenes;

// A train at 30 m/s over a plain, and a ball.
WorldDescription train_and_ball(const Vector3d& place, const Vector3d& velocity, bool aboard_train) {
  MovingFrame frame;
  frame.name = "train";
  frame.start.position = *canonical({}, {-40, 3, 2}, 16);
  frame.velocity = {30, 0, 0};
  frame.region = FrameRegion{{0, 0, 2}, {30, 6, 5}};
  WorldBuilder inside(settings_of(16));
  inside.add("floor", inside.shape(Box{{30, 6, 1}}), 1, {0, 0, -0.5}, Motion::kStatic);
  WorldBuilder outside(settings_of(16));
  outside.add("ground", outside.shape(Plane{}), 1, {0, 0, 0}, Motion::kStatic);
  WorldBuilder& with_ball = aboard_train ? inside : outside;
  with_ball.add("ball", with_ball.shape(Sphere{0.2}), 1, place).linear_velocity = velocity;
  WorldDescription world = aboard(frame, inside.world());
  add_all(outside.world(), world);
  return world;
}

BodyRecord ball_of(const Simulation& simulation) {
  std::optional<BodyRecord> ball;
  simulation.for_each_body([&](const BodyRecord& body) { ball = body; });
  return ball.value_or(BodyRecord{});
}

TEST(Crossings, ABallThrownFromATrainFliesOn) {
  const Vector3d place(2, 0, 1);
  const Vector3d velocity(1, 4, 3);
  const WorldDescription world = train_and_ball(place, velocity, /*aboard_train=*/true);
  const auto simulation = simulation_of(world);
  const Vector3d start = Vector3d(-40, 3, 2) + place;
  bool was_aboard = true;
  int crossings = 0;
  for (int tick = 1; tick <= 60; ++tick) {
    simulation->step();
    const double time = tick * simulation->partition().dt();
    const BodyRecord ball = ball_of(*simulation);
    const bool is_aboard = ball.home.frame != kWorldFrame;
    crossings += is_aboard != was_aboard ? 1 : 0;
    was_aboard = is_aboard;
    const Vector3d right =
        start + (velocity + Vector3d(30, 0, 0)) * time - Vector3d(0, 0, kPull) * (time * time / 2);
    EXPECT_LT((seen_from_outside(*simulation, ball) - right).norm(), 1e-4) << tick;
  }
  EXPECT_FALSE(was_aboard);
  EXPECT_EQ(crossings, 1);
}

// What a program measures from where it began goes on outside as it was aboard, along other axes.
TEST(Crossings, WhereAProgramBeganComesAlong) {
  WorldDescription world = train_and_ball({2, 0, 1}, {1, 4, 3}, /*aboard_train=*/true);
  MovingFrame& train = world.settings.frames.front();
  train.start.orientation = rotation_by({0, 0, 2});
  for (BodyDescription& body : world.bodies) {
    if (body.name == "ball") body.programs.push_back(example_program("pose"));
  }
  const auto simulation = simulation_of(world);
  Vector3d began = Vector3d::Zero();
  bool was_aboard = true;
  for (int tick = 1; tick <= 60; ++tick) {
    const double time = static_cast<double>(simulation->tick()) * simulation->partition().dt();
    simulation->step();
    const BodyRecord ball = ball_of(*simulation);
    const bool is_aboard = ball.home.frame != kWorldFrame;
    if (was_aboard && !is_aboard)
      began = Vector3d(-40, 3, 2) + train.velocity * time + train.start.orientation * Vector3d(2, 0, 1);
    was_aboard = is_aboard;
    const Vector3d measured(ball.programs.at(0).values.data());
    const Vector3d right = is_aboard ? Vector3d(place_of(*simulation, ball) - Vector3d(2, 0, 1))
                                     : Vector3d(seen_from_outside(*simulation, ball) - began);
    EXPECT_LT((measured - right).norm(), 1e-4) << tick;
  }
  EXPECT_FALSE(was_aboard);
}

TEST(Crossings, ABallThatFallsIntoATrainRestsInIt) {
  const auto simulation = simulation_of(train_and_ball({-41, 3, 9}, {30, 0, 0}, /*aboard_train=*/false));
  run_for(*simulation, 12);
  const BodyRecord ball = ball_of(*simulation);
  EXPECT_EQ(ball.home.frame, 1u);
  EXPECT_LT((place_of(*simulation, ball) - Vector3d(-1, 0, 0.2)).norm(), 0.05);
  EXPECT_EQ(ball.state.activity, Activity::kAsleep);
}

TEST(Crossings, BitsDoNotDependOnServers) {
  for (const bool aboard_train : {true, false}) {
    const WorldDescription world = aboard_train ? train_and_ball({2, 0, 1}, {1, 4, 3}, true)
                                                : train_and_ball({-41, 3, 9}, {30, 0, 0}, false);
    const std::vector<WorldHash> one = hashes_of(world, 1, 200);
    for (const std::uint32_t partitions : {2u, 4u})
      EXPECT_EQ(first_difference(one, hashes_of(world, partitions, 200)), one.size()) << partitions;
  }
}

// Two that turn, and all that goes between them.
TEST(Crossings, AndBackIsWhereItWas) {
  MovingFrame frame = frame_at({7.8e3, -20, 3}, {0.1, 0.2, -0.3});
  frame.start.orientation = rotation_by({0.3, 2, -1});
  BodyState state;
  state.position = {1, -2, 3};
  state.rotation = rotation_of(rotation_by({1, 2, 0.5}));
  state.linear_velocity = {5, 4, 3};
  state.angular_velocity = {0.1, 0.2, 0.3};
  WorldSettings settings = settings_of(16);
  settings.frames = {frame};
  const FramedBody inside{{7, 8, 9, 1}, state};
  const absl::StatusOr<FramePlace> place = frame_place(settings, 1, 3600);
  ASSERT_TRUE(place.ok());
  const absl::StatusOr<FramedBody> outside = out_of_frame(*place, inside, settings.sector_size);
  ASSERT_TRUE(outside.ok());
  const absl::StatusOr<FramedBody> again = into_frame(*place, 1, *outside, settings.sector_size);
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->home, inside.home);
  for (int n = 0; n < 3; ++n) {
    EXPECT_NEAR(again->state.position[n], state.position[n], 1e-8);
    EXPECT_NEAR(again->state.linear_velocity[n], state.linear_velocity[n], 1e-11);
    EXPECT_NEAR(again->state.angular_velocity[n], state.angular_velocity[n], 1e-15);
  }
  for (int n = 0; n < 9; ++n) EXPECT_NEAR(again->state.rotation[n], state.rotation[n], 1e-15);
}

// Ground that ends at x = 1, and a ferry at rest, which is turned, whose deck begins at x = -1; or without
// the ferry, ground that does not end. A stack of two boxes slides over from x = -1.5.
constexpr double kEdge = 0.5;  // m, of a box

WorldDescription stack_and_ferry(bool has_ferry, double sector_size = 16) {
  const auto floor = [](WorldBuilder& builder, const std::string& name, double size, const Vector3d& middle) {
    builder.add(name, builder.shape(Box{{size, 8, 1}}), 1, middle, Motion::kStatic).properties.friction = 0.1;
  };
  WorldBuilder outside(settings_of(sector_size));
  floor(outside, "quay", has_ferry ? 21 : 60, {has_ferry ? -9.5 : 0, 0, -0.5});
  for (int n = 0; n < 2; ++n) {
    BodyDescription& box = outside.add("box" + std::to_string(n), outside.shape(Box{{kEdge, kEdge, kEdge}}),
                                       5, {-1.5, 0.1, kEdge / 2 + kEdge * n});
    box.properties.friction = 0.6;
    box.linear_velocity = {3, 0, 0};
  }
  if (!has_ferry) return outside.world();
  MovingFrame frame;
  frame.name = "ferry";
  frame.start = {*canonical({}, {10, 2, -3}, sector_size), rotation_by({0, 0, 2})};
  const Eigen::Quaterniond back = frame.start.orientation.conjugate();
  const Vector3d origin(10, 2, -3);
  WorldBuilder deck(settings_of(sector_size));
  deck.add("deck", deck.shape(Box{{22, 8, 1}}), 1, back * Vector3d(Vector3d(10, 0, -0.5) - origin),
           Motion::kStatic);
  deck.world().bodies.back().pose.orientation = back;
  deck.world().bodies.back().properties.friction = 0.1;
  frame.region = FrameRegion{back * Vector3d(Vector3d(10, 0, 2) - origin), {40, 40, 6}};
  WorldDescription world = aboard(frame, deck.world());
  // The region is a box along the axes of the frame; on the other side of the quay, nobody is near.
  frame.region->size = {19, 19, 6};
  world.settings.frames = {frame};
  add_all(outside.world(), world);
  return world;
}

TEST(Crossings, AStackThatSlidesAboardStaysWhole) {
  const auto ferry = simulation_of(stack_and_ferry(true));
  const auto ground = simulation_of(stack_and_ferry(false));
  int crossings = 0;
  bool was_aboard = false;
  double worst = 0;
  double apart = 0;
  for (int tick = 1; tick <= 260; ++tick) {
    ferry->step();
    ground->step();
    const std::vector<BodyRecord> bodies = bodies_of(*ferry);
    ASSERT_EQ(bodies.size(), 2u);
    ASSERT_EQ(bodies[0].home.frame, bodies[1].home.frame) << "both in the same tick";
    const bool is_aboard = bodies[0].home.frame != kWorldFrame;
    crossings += is_aboard != was_aboard ? 1 : 0;
    was_aboard = is_aboard;
    const std::vector<BodyRecord> right = bodies_of(*ground);
    std::vector<Vector3d> off;
    for (std::size_t n = 0; n < 2; ++n)
      off.push_back(seen_from_outside(*ferry, bodies[n]) - seen_from_outside(*ground, right[n]));
    worst = std::max(worst, off[0].norm());
    apart = std::max(apart, (off[1] - off[0]).norm());
  }
  EXPECT_TRUE(was_aboard);
  EXPECT_EQ(crossings, 1);
  // What the deck bears, it learns in the tick in which they come.
  EXPECT_LT(worst, 2e-3);
  EXPECT_LT(apart, 1e-3);
  EXPECT_EQ(asleep(*ferry), 2);
}

// All of a world with one frame in another frame, which goes at 465 m/s.
WorldDescription in_another(WorldDescription world) {
  MovingFrame planet;
  planet.name = "planet";
  planet.start.position.sector = {1, 2, 3};
  planet.velocity = {0, 465, 0};
  MovingFrame inner = world.settings.frames.front();
  inner.start.position.sector.frame = 1;
  world.settings.frames = {planet, inner};
  for (BodyDescription& body : world.bodies) ++body.pose.position.sector.frame;
  return world;
}

TEST(Crossings, InAFrameThatMovesGoTheSameWay) {
  const WorldDescription world = stack_and_ferry(true);
  const auto alone = simulation_of(world);
  const auto moving = simulation_of(in_another(world));
  for (int tick = 0; tick < 200; ++tick) {
    alone->step();
    moving->step();
    const std::vector<BodyRecord> here = bodies_of(*alone);
    const std::vector<BodyRecord> there = bodies_of(*moving);
    for (std::size_t n = 0; n < here.size(); ++n) {
      SectorIndex home = here[n].home;
      ++home.frame;
      ASSERT_EQ(there[n].home, home) << tick;
      ASSERT_EQ(there[n].state.position, here[n].state.position) << tick;
      ASSERT_EQ(there[n].state.linear_velocity, here[n].state.linear_velocity) << tick;
    }
  }
  EXPECT_EQ(bodies_of(*moving).front().home.frame, 2u);
  const std::vector<WorldHash> one = hashes_of(in_another(stack_and_ferry(true, 2)), 1, 100);
  EXPECT_EQ(first_difference(one, hashes_of(in_another(stack_and_ferry(true, 2)), 4, 100)), one.size());
}

// Three boxes in a row, joined by balls.
WorldDescription train_and_row(double sector_size) {
  MovingFrame frame;
  frame.name = "train";
  frame.start.position = *canonical({}, {-40, 3, 2}, sector_size);
  frame.velocity = {30, 0, 0};
  frame.spin = {0, 0, 0.2};
  frame.region = FrameRegion{{0, 0, 2}, {30, 6, 5}};
  WorldBuilder inside(settings_of(sector_size, Vector3d::Zero()));
  for (int n = 0; n < 3; ++n) {
    BodyDescription& box =
        inside.add("box" + std::to_string(n), inside.shape(Box{{0.8, 0.3, 0.3}}), 2 + n, {2.0 + n, 0, 1});
    box.linear_velocity = {0, 4, 1};
    box.angular_velocity = {0, 0, 0.3 * n};
    if (n > 0)
      inside.tie("ball" + std::to_string(n), JointType::kBall, "box" + std::to_string(n - 1), box.name,
                 {1.5 + n, 0, 1});
  }
  return aboard(frame, inside.world());
}

// m, by which the balls have come apart.
double gap_of(const Simulation& simulation) {
  const std::vector<BodyRecord> bodies = bodies_of(simulation);
  double worst = 0;
  for (std::size_t n = 1; n < bodies.size(); ++n) {
    const Vector3d end = seen_from_outside(simulation, bodies[n - 1], {0.5, 0, 0});
    worst = std::max(worst, (seen_from_outside(simulation, bodies[n], {-0.5, 0, 0}) - end).norm());
  }
  return worst;
}

TEST(Crossings, WhatJointsHoldLeavesAsOne) {
  const auto simulation = simulation_of(train_and_row(16));
  bool was_aboard = true;
  Momentum before = momentum_of(*simulation);
  for (int tick = 1; tick <= 120; ++tick) {
    simulation->step();
    const std::vector<BodyRecord> bodies = bodies_of(*simulation);
    ASSERT_EQ(bodies.size(), 3u);
    const bool is_aboard = bodies.front().home.frame != kWorldFrame;
    for (const BodyRecord& body : bodies) ASSERT_EQ(body.home.frame != kWorldFrame, is_aboard) << tick;
    const Momentum now = momentum_of(*simulation);
    if (is_aboard != was_aboard) {
      EXPECT_LT((now.linear - before.linear).norm(), 1e-3) << tick;
      EXPECT_LT((now.angular - before.angular).norm(), 3e-2) << tick;
    }
    was_aboard = is_aboard;
    before = now;
  }
  EXPECT_FALSE(was_aboard);
  EXPECT_LT(gap_of(*simulation), 1e-3);
}

TEST(Crossings, BitsOfIslandsDoNotDependOnServers) {
  for (const WorldDescription& world : {stack_and_ferry(true, 2), train_and_row(2)}) {
    const std::vector<WorldHash> one = hashes_of(world, 1, 150);
    for (const std::uint32_t partitions : {2u, 4u, 9u})
      EXPECT_EQ(first_difference(one, hashes_of(world, partitions, 150)), one.size()) << partitions;
  }
}

// It rolls on the ground, and the region of the train passes over it.
TEST(Crossings, WhatStandsIsNotSweptAway) {
  WorldDescription world = train_and_ball({0, 3, 0.2}, {0.5, 0, 0}, /*aboard_train=*/false);
  world.settings.frames.front().region->size.z() = 9;
  const auto simulation = simulation_of(world);
  for (int tick = 0; tick < 180; ++tick) {
    simulation->step();
    ASSERT_EQ(ball_of(*simulation).home.frame, kWorldFrame) << tick;
  }
  EXPECT_GT(seen_from_outside(*simulation, ball_of(*simulation)).x(), 1);
}

// A pendulum in the air, in a region that passes.
TEST(Crossings, WhatIsTiedToTheWorldStaysInIt) {
  WorldDescription world = train_and_ball({0, 3, 4}, {0, 0, 0}, /*aboard_train=*/false);
  WorldBuilder builder(world.settings);
  builder.world() = std::move(world);
  builder.tie("string", JointType::kBall, "", "ball", {0, 3.5, 4.5});
  const auto simulation = simulation_of(builder.world());
  for (int tick = 0; tick < 180; ++tick) {
    simulation->step();
    ASSERT_EQ(ball_of(*simulation).home.frame, kWorldFrame) << tick;
  }
}

}  // namespace
}  // namespace tessera
