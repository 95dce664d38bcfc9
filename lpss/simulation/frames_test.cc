// Frames that move: the bits of a scene do not depend on its speed, and what is felt in a frame that turns or
// brakes is what mechanics says of it, seen from outside.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "lpss/base/rotation.h"
#include "lpss/model/frame_motion.h"
#include "lpss/simulation/frame_scenes.h"

namespace tessera {
namespace {

using Eigen::Vector3d;
using namespace frame_scenes;

WorldDescription busy_world() {
  WorldDescription world = pile_world(settings_of(8), 40);
  WorldBuilder builder(world.settings);
  builder.world() = std::move(world);
  builder.add_chain(8, {1, 2, 9}, Vector3d::UnitX());
  return builder.world();
}

TEST(Frames, BitsDoNotDependOnSpeedOrServers) {
  constexpr int kTicks = 150;
  const WorldDescription world = busy_world();
  const std::vector<WorldHash> still = hashes_of(aboard(frame_at(Vector3d::Zero()), world), 1, kTicks);
  for (const double speed : {30.0, 465.0, 7.8e3, 3e4, 3e7}) {
    const WorldDescription moving = aboard(frame_at(speed * Vector3d(1, 2, 2) / 3), world);
    EXPECT_EQ(first_difference(still, hashes_of(moving, 1, kTicks)), still.size()) << speed;
  }
  const WorldDescription fast = aboard(frame_at({3e7, 0, 0}), world);
  for (const std::uint32_t partitions : {2u, 4u})
    EXPECT_EQ(first_difference(still, hashes_of(fast, partitions, kTicks)), still.size()) << partitions;
}

TEST(Frames, BitsAreThoseOfTheWorldFrame) {
  const WorldDescription world = busy_world();
  const auto outside = simulation_of(world);
  const auto inside = simulation_of(aboard(frame_at({7.8e3, 0, 0}), world));
  for (int tick = 0; tick < 150; ++tick) {
    outside->step();
    inside->step();
  }
  std::vector<BodyRecord> bodies;
  outside->for_each_body([&](const BodyRecord& body) { bodies.push_back(body); });
  std::size_t n = 0;
  inside->for_each_body([&](const BodyRecord& body) {
    ASSERT_LT(n, bodies.size());
    SectorIndex home = body.home;
    home.frame = kWorldFrame;
    EXPECT_EQ(home, bodies[n].home);
    EXPECT_EQ(body.state.position, bodies[n].state.position);
    EXPECT_EQ(body.state.rotation, bodies[n].state.rotation);
    EXPECT_EQ(body.state.linear_velocity, bodies[n].state.linear_velocity);
    ++n;
  });
  EXPECT_EQ(n, bodies.size());
}

TEST(Frames, WhatIsInDifferentFramesDoesNotMeet) {
  WorldDescription world = tower_world(settings_of(16), 3, {0, 0, 0});
  WorldDescription other = aboard(frame_at({1, 0, 0}), tower_world(settings_of(16), 5, {0, 0, 0}));
  const auto alone = simulation_of(world);
  for (BodyDescription& body : other.bodies) body.name += "_aboard";
  add_all(other, world);
  world.settings.frames = other.settings.frames;
  const auto both = simulation_of(world);
  for (int tick = 0; tick < 200; ++tick) {
    alone->step();
    both->step();
  }
  alone->for_each_body([&](const BodyRecord& body) {
    EXPECT_EQ(body_of(*both, body.id.value).state.position, body.state.position);
  });
}

TEST(Frames, AShiftOfTheWorldChangesNoBit) {
  WorldDescription world = aboard(frame_at({30, 0, 0}, {0, 0, 0.1}), busy_world());
  const std::vector<WorldHash> here = hashes_of(world, 1, 60);
  const std::int64_t far = std::int64_t{1} << 61;
  ASSERT_TRUE(move_by(world, {far, -far + 1, 7}).ok());
  EXPECT_EQ(world.settings.frames.front().start.position.sector.i, far + 5);
  EXPECT_EQ(first_difference(here, hashes_of(world, 2, 60)), here.size());
}

class Train {
 public:
  // It goes at 30 m/s, and brakes after 4 s for 2 s.
  Train(double braking, double friction) {
    MovingFrame frame = frame_at({30, 0, 0});
    frame.legs = {{4, Vector3d::Zero()}, {2, {-braking, 0, 0}}};
    WorldBuilder builder(settings_of(16));
    builder.add("floor", builder.shape(Box{{40, 10, 1}}), 1, {0, 0, -0.5}, Motion::kStatic)
        .properties.friction = friction;
    const ShapeId box = builder.shape(Box{{0.5, 0.5, 0.3}});
    for (int n = 0; n < 8; ++n) {
      builder.add("box" + std::to_string(n), box, 10, {2.0 * n - 12, 0, 0.15}).properties.friction = friction;
    }
    world = aboard(frame, builder.world());
  }

  static constexpr std::uint64_t kFirst = 2;  // of the boxes
  WorldDescription world;
};

TEST(Frames, WhatRestsSleepsUntilTheTrainBrakes) {
  const auto train = simulation_of(Train(2, 0.5).world);
  run_for(*train, 3.9);
  EXPECT_EQ(asleep(*train), 8);
  EXPECT_TRUE(train->partition().at_rest);
  run_for(*train, 0.2);
  EXPECT_EQ(asleep(*train), 0);
  run_for(*train, 3.9);
  EXPECT_EQ(asleep(*train), 8);
  EXPECT_NEAR(place_of(*train, body_of(*train, Train::kFirst)).x(), -12, 1e-3) << "friction held it";
}

TEST(Frames, BrakesThatFrictionDoesNotHoldLetBoxesSlide) {
  constexpr double kBraking = 4;
  constexpr double kFriction = 0.25;
  const auto train = simulation_of(Train(kBraking, kFriction).world);
  run_for(*train, 6);
  const double past = kBraking - kFriction * kPull;
  const BodyRecord sliding = body_of(*train, Train::kFirst);
  EXPECT_NEAR(sliding.state.linear_velocity[0], 2 * past, 0.02);
  run_for(*train, 4);
  const double way = past * 2 * 2 / 2 + std::pow(2 * past, 2) / (2 * kFriction * kPull);
  EXPECT_NEAR(place_of(*train, body_of(*train, Train::kFirst)).x(), -12 + way, 0.02 * way);
}

TEST(Frames, ASnapshotGoesOnWithTheSameBits) {
  const WorldDescription world = Train(4, 0.25).world;
  const auto train = simulation_of(world);
  run_for(*train, 3.5);
  auto again = Simulation::restore(train->snapshot());
  ASSERT_TRUE(again.ok()) << again.status();
  for (int tick = 0; tick < 200; ++tick) {
    train->step();
    (*again)->step();
    ASSERT_EQ(train->hash(), (*again)->hash()) << tick;
  }
}

// A wheel in space, without gravity, that turns about y.
constexpr double kSpin = 0.3;  // rad/s
constexpr double kRim = 100;   // m: 9 m/s^2

WorldDescription habitat(const std::function<void(WorldBuilder&)>& fill) {
  WorldBuilder builder(settings_of(64, Vector3d::Zero()));
  builder.add("rim", builder.shape(Box{{40, 20, 2}}), 1, {0, 0, -kRim - 1}, Motion::kStatic)
      .properties.friction = 0.6;
  fill(builder);
  return aboard(frame_at({0, 0, 0}, {0, kSpin, 0}), builder.world());
}

// From the frame's axes to those at the start, in which what flies goes straight.
Eigen::Quaterniond turned_by(double time) { return rotation_by(Vector3d(0, kSpin * time, 0)); }

TEST(Frames, WhatFliesInAHabitatGoesStraightOutside) {
  for (const Vector3d& velocity : {Vector3d(0, 0, 0), Vector3d(4, -1, 7)}) {
    const Vector3d place(3, 2, -60);
    const auto simulation = simulation_of(habitat([&](WorldBuilder& builder) {
      builder.add("ball", builder.shape(Sphere{0.2}), 1, place).linear_velocity = velocity;
    }));
    const Vector3d outside = velocity + Vector3d(0, kSpin, 0).cross(place);
    double worst = 0;
    for (int tick = 1; tick <= 120; ++tick) {
      simulation->step();
      const double time = tick * simulation->partition().dt();
      const BodyRecord ball = body_of(*simulation, 2);
      const Vector3d right = turned_by(time).conjugate() * Vector3d(place + outside * time);
      worst = std::max(worst, (place_of(*simulation, ball) - right).norm());
      const Vector3d speed = turned_by(time).conjugate() * outside - Vector3d(0, kSpin, 0).cross(right);
      EXPECT_LT((Vector3d(ball.state.linear_velocity.data()) - speed).norm(), 2e-3);
    }
    EXPECT_LT(worst, 2e-3) << velocity.transpose();
  }
}

// A ring that turns in a station that turns: about another axis, and beside it.
TEST(Frames, WhatFliesInAFrameOfAFrameGoesStraightOutside) {
  WorldBuilder builder(settings_of(64, Vector3d::Zero()));
  const Vector3d place(3, 2, -4);
  const Vector3d velocity(1, -2, 0.5);
  builder.add("ball", builder.shape(Sphere{0.2}), 1, place).linear_velocity = velocity;
  WorldDescription world = aboard(frame_at({20, 0, 0}, {0, 0, 0.2}), builder.world());
  MovingFrame ring;
  ring.name = "ring";
  ring.start = {*canonical({0, 0, 0, 1}, {90, 10, 0}, 64), rotation_by({0.4, 0, 0})};
  ring.velocity = {0, 3, 0};
  ring.spin = {0.3, 0, 0};
  ring.legs = {{5, {0, 0, 1}}};
  world.settings.frames.push_back(ring);
  for (BodyDescription& body : world.bodies) body.pose.position.sector.frame = 2;
  const auto simulation = simulation_of(world);
  const auto seen = [&] {
    const Partition& partition = simulation->partition();
    const double time = static_cast<double>(simulation->tick()) * partition.dt();
    const FrameMotion motion = motion_in_world(partition.settings, ring, time);
    return std::pair(motion, time);
  };
  const FrameMotion start = seen().first;
  const Vector3d from = start.way + start.orientation * place;
  const Vector3d outside =
      start.velocity + start.spin.cross(start.orientation * place) + start.orientation * velocity;
  for (int tick = 1; tick <= 120; ++tick) {
    simulation->step();
    const auto [motion, time] = seen();
    const Vector3d now = motion.way + motion.orientation * place_of(*simulation, body_of(*simulation, 1));
    EXPECT_LT((now - from - outside * time).norm(), 5e-3) << tick;
  }
}

// What is at rest outside goes round and round inside.
TEST(Frames, EnergyDoesNotDriftInFreeFlight) {
  const Vector3d place(0, 0, -40);
  const auto simulation = simulation_of(habitat([&](WorldBuilder& builder) {
    builder.add("ball", builder.shape(Sphere{0.2}), 1, place).linear_velocity =
        -Vector3d(0, kSpin, 0).cross(place);
  }));
  run_for(*simulation, 600);
  const BodyRecord ball = body_of(*simulation, 2);
  EXPECT_NEAR(place_of(*simulation, ball).norm(), 40, 0.02);
  EXPECT_NEAR(Vector3d(ball.state.linear_velocity.data()).norm(), 40 * kSpin, 0.01);
}

TEST(Frames, AFreeBodyKeepsItsAngularMomentumOutside) {
  const Vector3d rate(0.4, -1, 2);  // rad/s, in the frame
  const auto simulation = simulation_of(habitat([&](WorldBuilder& builder) {
    BodyDescription& box = builder.add("box", builder.shape(Box{{1, 2, 3}}), 6, {0, 0, -1});
    box.linear_velocity = -Vector3d(0, kSpin, 0).cross(Vector3d(0, 0, -1));
    box.angular_velocity = rate;
  }));
  const auto momentum = [&](double time) -> Vector3d {
    const BodyRecord body = body_of(*simulation, 2);
    const Eigen::Matrix3d axes = quaternion_of(body.state).toRotationMatrix();
    const Eigen::Matrix3d inertia =
        axes * Vector3d(body.properties.inertia.data()).asDiagonal() * axes.transpose();
    return turned_by(time) *
           Vector3d(inertia * (Vector3d(body.state.angular_velocity.data()) + Vector3d(0, kSpin, 0)));
  };
  const Vector3d before = momentum(0);
  run_for(*simulation, 5);
  EXPECT_LT((momentum(5) - before).norm(), 0.02 * before.norm());
}

TEST(Frames, ATowerStandsInAHabitatAndSleeps) {
  const WorldDescription world = habitat([](WorldBuilder& builder) {
    const ShapeId box = builder.shape(Box{{1, 1, 1}});
    for (int n = 0; n < 6; ++n)
      builder.add("box" + std::to_string(n), box, 10, {0, 0, -kRim + 0.5 + n}).properties.friction = 0.6;
  });
  const auto simulation = simulation_of(world);
  run_for(*simulation, 10);
  EXPECT_EQ(asleep(*simulation), 6);
  EXPECT_NEAR(place_of(*simulation, body_of(*simulation, 7)).z(), -kRim + 5.5, 0.01);
  const std::vector<WorldHash> one = hashes_of(world, 1, 120);
  EXPECT_EQ(first_difference(one, hashes_of(world, 3, 120)), one.size());
}

TEST(Frames, ThePlaceInTheWorldFollowsFromThePath) {
  MovingFrame frame = frame_at({3, 0, 0}, {0, 0, std::numbers::pi / 2});
  frame.legs = {{2, {1, 0, 0}}};
  frame.start.position = {{1, 0, 0}, {0.5, 0, 0}};
  // 3 m/s and 1 m/s^2 for 2 s: 8 m; then 5 m/s for a second. 270 degrees.
  WorldSettings settings = settings_of(16);
  settings.frames = {frame};
  const absl::StatusOr<WorldPose> pose =
      pose_in_world(settings, 3, {{{0, 1, 0, 1}, {1, 2, 3}}, Eigen::Quaterniond::Identity()});
  ASSERT_TRUE(pose.ok());
  const Vector3d place = relative_to(pose->position, {0, 0, 0}, 16);
  EXPECT_LT((place - Vector3d(16 + 0.5 + 13 + 18, -1, 3)).norm(), 1e-12);
  EXPECT_NEAR(rotation_angle(pose->orientation), std::numbers::pi / 2, 1e-12);
}

}  // namespace
}  // namespace tessera
