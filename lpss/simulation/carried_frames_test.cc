// Frames that bodies carry: what is in them has the bits of one at rest while the carrier coasts, and feels
// what the carrier does.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "lpss/base/rotation.h"
#include "lpss/model/frame_motion.h"
#include "lpss/simulation/frame_scenes.h"
#include "lpss/simulation/partition_cluster.h"

namespace tessera {
namespace {

using Eigen::Vector3d;
using namespace frame_scenes;

constexpr BodyId kHull{1};

// A hull of 1,000 kg, which carries a frame that is larger than itself, and what is in it.
WorldDescription carried(const std::function<void(BodyDescription&)>& set_hull,
                         const std::function<void(WorldBuilder&)>& fill,
                         const Vector3d& gravity = {0, 0, -kPull}, double sector_size = 16) {
  WorldBuilder outside(settings_of(sector_size, gravity));
  BodyDescription& hull = outside.add("hull", outside.shape(Box{{7, 3, 2}}), 1000, {3, -2, 50});
  set_hull(hull);
  WorldBuilder inside(settings_of(sector_size, gravity));
  fill(inside);
  MovingFrame frame;
  frame.name = "ship";
  frame.carrier = FrameCarrier{kHull, {{0, 0, -1.5}, Eigen::Quaterniond::Identity()}};
  frame.region = FrameRegion{{0, 0, 1.5}, {8, 4, 3}};
  WorldDescription contents = aboard(frame, inside.world());
  WorldDescription world = outside.world();
  world.settings.frames = contents.settings.frames;
  add_all(contents, world);
  place_carried(world);
  return world;
}

void coast(BodyDescription& hull) {
  hull.properties.motion = Motion::kKinematic;
  hull.linear_velocity = {40, 3, -1};
}

std::vector<BodyRecord> contents_of(const Simulation& simulation) {
  std::vector<BodyRecord> bodies;
  simulation.for_each_body([&](const BodyRecord& body) {
    if (body.id != kHull) bodies.push_back(body);
  });
  return bodies;
}

TEST(CarriedFrames, WhileTheCarrierCoastsBitsAreThoseAtRest) {
  const auto moving = simulation_of(carried(coast, add_stack));
  const auto still = simulation_of(
      carried([](BodyDescription& hull) { hull.properties.motion = Motion::kKinematic; }, add_stack));
  for (int tick = 0; tick < 150; ++tick) {
    moving->step();
    still->step();
    const std::vector<BodyRecord> here = contents_of(*moving);
    const std::vector<BodyRecord> there = contents_of(*still);
    ASSERT_EQ(here.size(), 4u);
    for (std::size_t n = 0; n < 4; ++n) {
      ASSERT_EQ(here[n].home, there[n].home) << tick;
      ASSERT_EQ(here[n].state.position, there[n].state.position) << tick;
      ASSERT_EQ(here[n].state.rotation, there[n].state.rotation) << tick;
    }
  }
  EXPECT_EQ(contents_of(*moving).front().state.activity, Activity::kAsleep);
}

// Thrust of 3 m/s^2 for two seconds, with friction of 0.2: what is aboard slides back by what is left.
constexpr double kHeavy = 1e6;  // kg

// So that what is aboard does not pitch it.
void make_heavy(BodyDescription& hull) {
  for (double& moment : hull.properties.inertia) moment *= kHeavy / hull.properties.mass;
  hull.properties.mass = kHeavy;
}

TEST(CarriedFrames, WhatThrustDoesIsFeltAboard) {
  static constexpr double kFriction = 0.2;
  constexpr double kThrust = 3;  // m/s^2
  const auto ship = simulation_of(carried(make_heavy, [](WorldBuilder& builder) {
    add_floor(builder, kFriction);
    builder.add("box", builder.shape(Box{{0.5, 0.5, 0.3}}), 5, {0, 0, 0.15}).properties.friction = kFriction;
  }));
  const double dt = ship->partition().dt();
  ApplyForce thrust{kHull, {}};
  thrust.wrench.force = {kHeavy * kThrust, 0, kHeavy * kPull};
  ApplyForce hover = thrust;
  hover.wrench.force[0] = 0;
  // It hovers, so that the box comes to rest.
  for (int tick = 0; tick < 60; ++tick) ship->step(std::vector<Command>{hover});
  const double before = place_of(*ship, contents_of(*ship).front()).x();
  const auto thrust_ticks = static_cast<int>(std::lround(2 / dt));
  for (int tick = 0; tick < thrust_ticks; ++tick) ship->step(std::vector<Command>{thrust});
  for (int tick = 0; tick < 240; ++tick) ship->step(std::vector<Command>{hover});
  const double past = kThrust - kFriction * kPull;
  const double way = past * 2 * 2 / 2 + std::pow(2 * past, 2) / (2 * kFriction * kPull);
  EXPECT_NEAR(place_of(*ship, contents_of(*ship).front()).x() - before, -way, 0.03 * way);
}

TEST(CarriedFrames, InACarrierThatFallsNothingHasWeight) {
  const auto ship = simulation_of(carried(
      [](BodyDescription& hull) {
        hull.linear_velocity = {5, 0, 20};
      },
      [](WorldBuilder& builder) {
        builder.add("ball", builder.shape(Sphere{0.2}), 1, {1, 0, 1}).linear_velocity = {0.1, 0, 0};
      }));
  run_for(*ship, 3);
  const BodyRecord ball = contents_of(*ship).front();
  ASSERT_EQ(ball.home.frame, 1u);
  // One tick of falling before the ship is known to fall.
  const double late = kPull * ship->partition().dt();
  EXPECT_LT((place_of(*ship, ball) - Vector3d(1.3, 0, 1 - late * 3)).norm(), 0.02);
}

// In space, about an axis of the hull.
TEST(CarriedFrames, WhatFloatsInOneThatTurnsGoesStraightOutside) {
  static constexpr double kTurn = 0.4;  // rad/s
  const auto ship = simulation_of(carried(
      [](BodyDescription& hull) {
        hull.angular_velocity = {0, 0, kTurn};
        hull.linear_velocity = {2, 0, 0};
      },
      [](WorldBuilder& builder) {
        builder.add("ball", builder.shape(Sphere{0.2}), 1, {1, 0.5, 1}).linear_velocity = {0.3, 0.1, 0.05};
      },
      Vector3d::Zero()));
  const Vector3d place(1, 0.5, 1);
  const Vector3d outside = Vector3d(0.3, 0.1, 0.05) + Vector3d(0, 0, kTurn).cross(place);
  for (int tick = 1; tick <= 90; ++tick) {
    ship->step();
    const BodyRecord ball = contents_of(*ship).front();
    ASSERT_EQ(ball.home.frame, 1u);
    const double time = tick * ship->partition().dt();
    const Vector3d right = rotation_by({0, 0, -kTurn * time}) * Vector3d(place + outside * time);
    EXPECT_LT((place_of(*ship, ball) - right).norm(), 5e-3) << tick;
  }
}

TEST(CarriedFrames, WhatFloatsGoesStraightAgainOnceTheCarrierHasStoppedTurning) {
  const auto ship = simulation_of(carried(
      [](BodyDescription& hull) {
        hull.properties.motion = Motion::kKinematic;
        hull.angular_velocity = {0, 0, 0.4};
      },
      [](WorldBuilder& builder) {
        builder.add("ball", builder.shape(Sphere{0.2}), 1, {1, 0.5, 1}).linear_velocity = {0.3, 0.1, 0.05};
      },
      Vector3d::Zero()));
  run_for(*ship, 0.5);
  ship->step(std::vector<Command>{SetVelocity{kHull, {}, {}}});
  run_for(*ship, 0.1);
  const auto velocity = [&] { return Vector3d(contents_of(*ship).front().state.linear_velocity.data()); };
  const Vector3d before = velocity();
  run_for(*ship, 1);
  EXPECT_LT((velocity() - before).norm(), 1e-6);
}

TEST(CarriedFrames, WhatIsThrownOutFliesOn) {
  const auto ship = simulation_of(carried(coast, [](WorldBuilder& builder) {
    builder.add("ball", builder.shape(Sphere{0.2}), 1, {1, 0, 1}).linear_velocity = {0, 5, 2};
  }));
  const Vector3d start = Vector3d(3, -2, 48.5) + Vector3d(1, 0, 1);
  const Vector3d velocity = Vector3d(40, 3, -1) + Vector3d(0, 5, 2);
  bool is_out = false;
  for (int tick = 1; tick <= 60; ++tick) {
    ship->step();
    const BodyRecord ball = contents_of(*ship).front();
    is_out = ball.home.frame == kWorldFrame;
    const double time = tick * ship->partition().dt();
    const Vector3d right = start + velocity * time - Vector3d(0, 0, kPull) * (time * time / 2);
    EXPECT_LT((seen_from_outside(*ship, ball) - right).norm(), 1e-4) << tick;
  }
  EXPECT_TRUE(is_out);
}

// --- what is aboard acts on its carrier ---

BodyRecord hull_of(const Simulation& simulation) { return body_of(simulation, kHull.value); }

// It flies to the wall at the bow.
WorldDescription crew_and_ship(double mass, const Vector3d& velocity) {
  return carried(
      [](BodyDescription&) {},
      [&](WorldBuilder& builder) {
        builder.add("bow", builder.shape(Box{{1, 6, 6}}), 1, {4, 0, 1.5}, Motion::kStatic);
        builder.add("crew", builder.shape(Box{{0.5, 0.5, 1}}), mass, {0, 0, 1.5}).linear_velocity = velocity;
      },
      Vector3d::Zero());
}

// As the crew stops, the ship has all of its momentum for a moment, and the crew none.
TEST(CarriedFrames, WhoRunsToTheBowMovesTheShip) {
  for (const double mass : {80.0, 400.0}) {
    const auto ship = simulation_of(crew_and_ship(mass, {1, 0, 0}));
    run_for(*ship, 6);
    const double together = mass / (1000 + mass);
    const double speed = hull_of(*ship).state.linear_velocity[0];
    EXPECT_GT(speed, 0.99 * together) << mass;
    EXPECT_LT(speed, 1.01 * mass / 1000) << mass;
    EXPECT_NEAR(momentum_of(*ship).linear.x(), mass, 1e-6 * mass) << mass;
  }
}

// 5 t aboard a hull of 1 t: the two together are pushed.
TEST(CarriedFrames, CargoIsPushedWithItsCarrier) {
  const auto ship = simulation_of(
      carried([](BodyDescription&) {},
              [](WorldBuilder& builder) {
                builder.add("stern", builder.shape(Box{{1, 6, 6}}), 1, {-2, 0, 1.5}, Motion::kStatic);
                builder.add("cargo", builder.shape(Box{{1, 1, 1}}), 5000, {-1, 0, 1.5});
              },
              Vector3d::Zero()));
  ApplyForce thrust{kHull, {}};
  thrust.wrench.force = {6000, 0, 0};
  for (int tick = 0; tick < 120; ++tick) ship->step(std::vector<Command>{thrust});
  EXPECT_NEAR(hull_of(*ship).state.linear_velocity[0], 2, 0.04);
  EXPECT_NEAR(momentum_of(*ship).linear.x(), 12000, 250) << "what a tick owes the next";
}

// Cargo that is lashed down beside the centre of mass turns the ship: as if both were one body.
TEST(CarriedFrames, CargoBesideTheCentreTurnsItsCarrier) {
  static constexpr double kCargo = 800;
  static constexpr double kArm = 3;  // m
  WorldDescription world =
      carried([](BodyDescription&) {},
              [](WorldBuilder& builder) {
                builder.add("cargo", builder.shape(Box{{1, 1, 1}}), kCargo, {kArm, 0, 1.5});
              },
              Vector3d::Zero());
  WorldBuilder builder(world.settings);
  builder.world() = std::move(world);
  JointDescription& lash = builder.tie("lash", JointType::kFixed, "", "hull", {kArm, 0, 1.5});
  lash.properties.child = BodyId{2};
  lash.properties.anchor.frame = 1;
  lash.properties.in_child = {};
  lash.properties.in_parent.position = {kArm, 0, 1.5};
  const auto ship = simulation_of(builder.world());
  ApplyForce thrust{kHull, {}};
  thrust.wrench.force = {0, 0, 500};
  const auto spin_after = [&](int ticks) {
    for (int tick = 0; tick < ticks; ++tick) ship->step(std::vector<Command>{thrust});
    return hull_of(*ship).state.angular_velocity[1];
  };
  const double before = spin_after(20);
  const double gained = spin_after(60) - before;
  const BodyRecord hull = hull_of(*ship);
  const BodyRecord cargo = body_of(*ship, 2);
  const double beside = kCargo * kArm / (1000 + kCargo);  // m, of the common centre of mass from the hull's
  const double inertia = hull.properties.inertia[1] + 1000 * beside * beside + cargo.properties.inertia[1] +
                         kCargo * (kArm - beside) * (kArm - beside);
  EXPECT_NEAR(gained, 500 * beside / inertia, 0.02 * 500 * beside / inertia);
}

TEST(CarriedFrames, MomentumIsKeptWithWhatTumblesAboard) {
  const auto ship = simulation_of(carried(
      [](BodyDescription& hull) {
        hull.linear_velocity = {2, 0, 1};
        hull.angular_velocity = {0.05, 0.1, -0.08};
      },
      [](WorldBuilder& builder) {
        for (const double side : {-1.0, 1.0}) {
          const std::string name = side < 0 ? "a" : "b";
          builder.add("x" + name, builder.shape(Box{{1, 9, 9}}), 1, {3.5 * side, 0, 1.5}, Motion::kStatic);
          builder.add("y" + name, builder.shape(Box{{9, 1, 9}}), 1, {0, 2.3 * side, 1.5}, Motion::kStatic);
          builder.add("z" + name, builder.shape(Box{{9, 9, 1}}), 1, {0, 0, 1.5 + 2 * side}, Motion::kStatic);
        }
        const ShapeId box = builder.shape(Box{{0.5, 0.4, 0.3}});
        for (int n = 0; n < 12; ++n) {
          builder
              .add("box" + std::to_string(n), box, 20 + 5 * n,
                   {0.6 * (n % 5) - 1.2, 0.5 * (n % 3) - 0.5, 1 + 0.4 * (n / 4)})
              .linear_velocity = {1.0 * (n % 3), 0.5 - 0.3 * (n % 4), 0.7};
        }
      },
      Vector3d::Zero()));
  const Momentum before = momentum_of(*ship);
  const auto error = [&] {
    const Momentum now = momentum_of(*ship);
    return std::pair((now.linear - before.linear).norm() / before.linear.norm(),
                     (now.angular - before.angular).norm() / before.angular.norm());
  };
  double worst = 0;
  for (int tick = 0; tick < 600; ++tick) {
    ship->step();
    worst = std::max(worst, error().first);
  }
  EXPECT_LT(worst, 0.1) << "what a tick owes the next";
  EXPECT_LT(error().first, 1e-3);
  EXPECT_LT(error().second, 5e-3);
  // As much as is still owed is paid as the next tick begins.
  const Vector3d with_owed = momentum_of(*ship).linear + 2 * ship->partition().carried.front().owed;
  EXPECT_LT((with_owed - before.linear).norm(), 1e-5 * before.linear.norm());
}

WorldDescription tumbling_ship() { return carried(tumble, add_stack_and_thrown, {0, 0, -kPull}, 10); }

TEST(CarriedFrames, BitsDoNotDependOnServers) { expect_same_bits_on_servers(tumbling_ship()); }

TEST(CarriedFrames, ASnapshotGoesOnWithTheSameBits) {
  const auto ship = simulation_of(tumbling_ship());
  run_for(*ship, 0.5);
  auto again = Simulation::restore(ship->snapshot());
  ASSERT_TRUE(again.ok()) << again.status();
  for (int tick = 0; tick < 60; ++tick) {
    ship->step();
    (*again)->step();
    ASSERT_EQ(ship->hash(), (*again)->hash()) << tick;
  }
}

// A push is divided by the mass of carrier and cargo, which changes as cargo comes and goes.
TEST(CarriedFrames, ASnapshotIsPushedWithItsCargo) {
  const auto ship = simulation_of(tumbling_ship());
  const std::vector<Command> push = {ApplyImpulse{kHull, {400, -100, 300}, {0.2, 0, -0.5}}};
  for (int tick = 0; tick < 60; ++tick) {
    auto again = Simulation::restore(ship->snapshot());
    ASSERT_TRUE(again.ok()) << again.status();
    ship->step(push);
    (*again)->step(push);
    ASSERT_EQ(ship->hash(), (*again)->hash()) << tick;
  }
}

// Also in the ticks in which it becomes known aboard that the ship is pushed.
TEST(CarriedFrames, SnapshotsKnowWhatWasFelt) {
  const auto ship = simulation_of(carried(coast, add_stack));
  run_for(*ship, 3);
  ASSERT_EQ(asleep(*ship), 4);
  ship->step(std::vector<Command>{SetVelocity{kHull, {42, 3, -1}, {}}});
  std::vector<WorldSnapshot> snapshots;
  std::vector<WorldHash> hashes;
  for (int tick = 0; tick < 6; ++tick) {
    snapshots.push_back(ship->snapshot());
    ship->step();
    hashes.push_back(ship->hash());
  }
  EXPECT_EQ(asleep(*ship), 0);
  for (std::size_t first = 0; first < snapshots.size(); ++first) {
    auto again = Simulation::restore(snapshots[first]);
    ASSERT_TRUE(again.ok()) << again.status();
    for (std::size_t tick = first; tick < hashes.size(); ++tick) {
      (*again)->step();
      ASSERT_EQ((*again)->hash(), hashes[tick]) << first << " " << tick;
    }
  }
}

// The frame stands still where its carrier was.
TEST(CarriedFrames, ACarrierMayBeRemoved) {
  const auto ship = simulation_of(carried(coast, add_stack));
  run_for(*ship, 0.5);
  ship->step(std::vector<Command>{RemoveBody{kHull}});
  run_for(*ship, 3);
  const CarriedFrame& frame = ship->partition().carried.front();
  EXPECT_TRUE(frame.place.velocity.isZero(0));
  EXPECT_TRUE(frame.acceleration.isZero(0));
  EXPECT_EQ(asleep(*ship), 4);
}

TEST(CarriedFrames, CarriersAreChecked) {
  WorldDescription world = carried(coast, add_stack);
  MovingFrame& frame = world.settings.frames.front();
  frame.carrier->body = BodyId{9};
  EXPECT_NE(Simulation::create(world).status().message().find("carrier 9 must be from 1 to 6"),
            std::string::npos)
      << Simulation::create(world).status();
  frame.carrier->body = BodyId{2};
  EXPECT_NE(Simulation::create(world).status().message().find("must be dynamic or kinematic"),
            std::string::npos);
  frame.carrier->body = kHull;
  frame.falls = true;
  EXPECT_NE(Simulation::create(world).status().message().find("neither falls nor has legs"),
            std::string::npos);
}

}  // namespace
}  // namespace tessera
