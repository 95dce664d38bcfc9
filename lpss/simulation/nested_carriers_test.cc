// Carriers in frames that move: a ferry on a planet that turns, a cart on a train, a cart on a ferry.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lpss/model/frame_motion.h"
#include "lpss/model/validate.h"
#include "lpss/simulation/frame_scenes.h"
#include "lpss/simulation/partition_cluster.h"

namespace tessera::nested_carriers {
namespace {

using Eigen::Vector3d;
using namespace frame_scenes;

constexpr BodyId kHull{1};
constexpr FrameNumber kAboard = 2;

// A hull of 1,000 kg in a frame, which carries another one, and what is in that.
WorldDescription carried_in(MovingFrame outer, const std::function<void(BodyDescription&)>& set_hull,
                            const std::function<void(WorldBuilder&)>& fill,
                            const Vector3d& gravity = Vector3d::Zero(), double sector_size = 16) {
  WorldBuilder around(settings_of(sector_size, gravity));
  BodyDescription& hull = around.add("hull", around.shape(Box{{7, 3, 2}}), 1000, {3, -2, 50});
  set_hull(hull);
  WorldBuilder inside(settings_of(sector_size, gravity));
  fill(inside);
  outer.name = "around";
  WorldDescription world = aboard(outer, around.world());
  MovingFrame frame;
  frame.name = "ship";
  frame.start.position.sector.frame = 1;
  frame.carrier = FrameCarrier{kHull, {{0, 0, -1.5}, Eigen::Quaterniond::Identity()}};
  frame.region = FrameRegion{{0, 0, 1.5}, {8, 4, 3}};
  world.settings.frames.push_back(frame);
  WorldDescription contents = inside.world();
  for (BodyDescription& body : contents.bodies) body.pose.position.sector.frame = kAboard;
  add_all(contents, world);
  place_carried(world);
  return world;
}

void coast(BodyDescription& hull) {
  hull.properties.motion = Motion::kKinematic;
  hull.linear_velocity = {2, 1, -0.5};
}

void add_ball(WorldBuilder& builder) {
  builder.add("ball", builder.shape(Sphere{0.2}), 1, {0.2, 0.1, 1.2}).linear_velocity = {0.3, 0.1, 0.05};
}

// Seen from outside, where nothing turns, along a line.
void expect_straight(const WorldDescription& world, double near) {
  const auto ship = simulation_of(world);
  const auto ball = [&] { return bodies_of(*ship).back(); };
  const Vector3d start = seen_from_outside(*ship, ball());
  const Vector3d velocity(outside(*ship, ball()).state.linear_velocity.data());
  for (int tick = 1; tick <= 90; ++tick) {
    ship->step();
    ASSERT_EQ(ball().home.frame, kAboard);
    const Vector3d right = start + velocity * (tick * ship->partition().dt());
    ASSERT_LT((seen_from_outside(*ship, ball()) - right).norm(), near) << tick;
  }
}

TEST(NestedCarriers, WhatFloatsAboardGoesStraight) {
  expect_straight(carried_in(frame_at({300, 20, -5}, {0.05, 0.1, 0.2}), coast, add_ball), 2e-4);
}

// What the hull itself feels of the habitat is known aboard a tick late.
TEST(NestedCarriers, WhatFloatsInOneThatFloatsGoesStraight) {
  expect_straight(carried_in(
                      frame_at({300, 20, -5}, {0.02, 0.05, 0.1}),
                      [](BodyDescription& hull) {
                        hull.linear_velocity = {0.2, 0.1, -0.1};
                        hull.angular_velocity = {0.1, -0.05, 0.2};
                      },
                      add_ball),
                  0.1);
}

void expect_same_bits(const std::function<void(BodyDescription&)>& set_hull,
                      const std::function<void(WorldBuilder&)>& fill) {
  const Vector3d gravity(0, 0, -kPull);
  for (const double speed : {30.0, 7800.0, 3e7}) {
    const auto moving = simulation_of(carried_in(frame_at({speed, -speed, 0}), set_hull, fill, gravity));
    const auto still = simulation_of(carried_in(frame_at(Vector3d::Zero()), set_hull, fill, gravity));
    for (int tick = 0; tick < 100; ++tick) {
      moving->step();
      still->step();
      const std::vector<BodyRecord> here = bodies_of(*moving);
      const std::vector<BodyRecord> there = bodies_of(*still);
      ASSERT_EQ(here.size(), there.size());
      for (std::size_t n = 0; n < here.size(); ++n) {
        ASSERT_EQ(here[n].home, there[n].home) << speed << " " << tick;
        ASSERT_EQ(here[n].state.position, there[n].state.position) << speed << " " << tick;
        ASSERT_EQ(here[n].state.rotation, there[n].state.rotation) << speed << " " << tick;
      }
    }
  }
}

TEST(NestedCarriers, BitsDoNotDependOnTheSpeedOfTheFrameAround) {
  expect_same_bits(coast, add_stack);
  // It falls, tumbles, and is pushed by what moves aboard.
  expect_same_bits(
      [](BodyDescription& hull) {
        hull.angular_velocity = {0.1, 0.3, -0.2};
      },
      [](WorldBuilder& builder) {
        add_stack(builder);
        add_ball(builder);
      });
}

// A cart stands on a train that brakes by 4 m/s^2: what is aboard the cart slides as on the train itself.
TEST(NestedCarriers, BrakesOfTheFrameAroundAreFelt) {
  MovingFrame train = frame_at({10, 0, 0});
  train.legs = {{1, Vector3d::Zero()}, {2, {-4, 0, 0}}};
  const auto add_box = [](WorldBuilder& builder) {
    add_floor(builder, 0.25);
    builder.add("box", builder.shape(Box{{0.8, 0.6, 0.2}}), 10, {0, 0, 0.1}).properties.friction = 0.25;
  };
  const auto way = [](Simulation& simulation) {
    const Vector3d from = place_of(simulation, bodies_of(simulation).back());
    run_for(simulation, 6);
    return Vector3d(place_of(simulation, bodies_of(simulation).back()) - from);
  };
  const Vector3d gravity(0, 0, -kPull);
  const auto stand = [](BodyDescription& hull) { hull.properties.motion = Motion::kKinematic; };
  WorldDescription cart = carried_in(train, stand, add_box, gravity);
  cart.settings.frames[1].region.reset();
  WorldBuilder on_train(settings_of(16, gravity));
  add_box(on_train);
  const Vector3d right = way(*simulation_of(aboard(train, on_train.world())));
  EXPECT_GT(right.x(), 4);
  EXPECT_LT((way(*simulation_of(cart)) - right).norm(), 1e-4);
}

// The frame around turns, which changes no momentum.
TEST(NestedCarriers, MomentumIsKept) {
  MovingFrame habitat = frame_at(Vector3d::Zero(), {0.02, 0.04, 0.05});
  habitat.start.position.sector = {};
  const auto ship = simulation_of(carried_in(
      habitat,
      [](BodyDescription& hull) {
        hull.linear_velocity = {1, 2, 0.5};
      },
      [](WorldBuilder& builder) {
        builder.add("bow", builder.shape(Box{{1, 6, 6}}), 1, {4, 0, 1.5}, Motion::kStatic);
        builder.add("crew", builder.shape(Box{{0.5, 0.5, 1}}), 200, {0, 0, 1.5}).linear_velocity = {1, 0, 0};
      }));
  const Momentum before = momentum_of(*ship);
  const Vector3d hull_before(outside(*ship, body_of(*ship, kHull.value)).state.linear_velocity.data());
  run_for(*ship, 5);
  const Momentum after = momentum_of(*ship);
  const Vector3d hull_after(outside(*ship, body_of(*ship, kHull.value)).state.linear_velocity.data());
  EXPECT_GT((hull_after - hull_before).norm(), 0.1) << "the crew has pushed it";
  EXPECT_LT((after.linear - before.linear).norm(), 1e-3 * before.linear.norm());
  EXPECT_LT((after.angular - before.angular).norm(), 5e-3 * before.angular.norm());
}

// A force pushes a ship of 1 t with a cart of 1 t, which holds 4 t.
TEST(NestedCarriers, WhatACartCarriesWeighsOnTheShipAroundIt) {
  WorldBuilder space(settings_of(16, Vector3d::Zero()));
  space.add("hull", space.shape(Box{{7, 3, 2}}), 1000, {3, -2, 50});
  WorldDescription world = space.world();
  const auto add_frame = [&](const std::string& name, BodyId carrier, const WorldDescription& contents) {
    MovingFrame frame;
    frame.name = name;
    frame.start.position.sector.frame = static_cast<FrameNumber>(world.settings.frames.size());
    frame.carrier = FrameCarrier{carrier, {}};
    world.settings.frames.push_back(frame);
    WorldDescription placed = contents;
    for (BodyDescription& body : placed.bodies)
      body.pose.position.sector.frame = static_cast<FrameNumber>(world.settings.frames.size());
    add_all(placed, world);
  };
  const auto with_stern = [](const std::string& name, double mass) {
    WorldBuilder inside(settings_of(16, Vector3d::Zero()));
    inside.add(name + "_stern", inside.shape(Box{{1, 6, 6}}), 1, {-2, 0, 0}, Motion::kStatic);
    inside.add(name, inside.shape(Box{{1, 1, 1}}), mass, {-1, 0, 0});
    return inside.world();
  };
  add_frame("ship", kHull, with_stern("cart", 1000));
  add_frame("cart", BodyId{3}, with_stern("cargo", 4000));
  place_carried(world);
  const auto ship = simulation_of(world);
  ApplyForce thrust{kHull, {}};
  thrust.wrench.force = {6000, 0, 0};
  for (int tick = 0; tick < 120; ++tick) ship->step(std::vector<Command>{thrust});
  EXPECT_NEAR(body_of(*ship, kHull.value).state.linear_velocity[0], 2, 0.1) << "two ticks late";
  for (const std::uint64_t body : {3u, 5u})
    EXPECT_LT(Vector3d(body_of(*ship, body).state.linear_velocity.data()).norm(), 0.02) << body;
}

WorldDescription tumbling_ship() {
  return carried_in(frame_at({20, 5, 0}, {0.02, -0.05, 0.1}), tumble, add_stack_and_thrown, {0, 0, -kPull},
                    10);
}

TEST(NestedCarriers, BitsDoNotDependOnServers) { expect_same_bits_on_servers(tumbling_ship()); }

TEST(NestedCarriers, ASnapshotGoesOnWithTheSameBits) {
  const auto ship = simulation_of(tumbling_ship());
  for (int part = 0; part < 4; ++part) {
    run_for(*ship, 0.3);
    auto again = Simulation::restore(ship->snapshot());
    ASSERT_TRUE(again.ok()) << again.status();
    for (int tick = 0; tick < 30; ++tick) {
      ship->step();
      (*again)->step();
      ASSERT_EQ(ship->hash(), (*again)->hash()) << part << " " << tick;
    }
  }
}

TEST(NestedCarriers, ACarrierIsInTheFrameThatItsOwnMovesIn) {
  WorldDescription world = carried_in(frame_at({20, 5, 0}), coast, add_stack);
  const auto said = [&] { return std::string(Simulation::create(world).status().message()); };
  EXPECT_EQ(said(), "");
  BodyDescription& hull = world.bodies.front();
  hull.pose.position.sector.frame = kWorldFrame;
  EXPECT_NE(said().find("its carrier, body 'hull', must be in the frame 'around'"), std::string::npos)
      << said();
  hull.pose.position.sector.frame = kAboard;
  place_carried(world);
  EXPECT_NE(said().find("must be in the frame 'around'"), std::string::npos) << said();
  const WorldSettings& settings = world.settings;
  EXPECT_TRUE(carrier_home({0, 0, 0, 1}, kHull, settings).ok());
  EXPECT_EQ(carrier_home({}, kHull, settings).message(),
            "it carries the frame 'ship', and stays in the frame 'around'");
}

}  // namespace
}  // namespace tessera::nested_carriers
