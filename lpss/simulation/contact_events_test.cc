// Contact events: a patch each, with what it bears, and an end in the tick in which the contact ends.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "lpss/engine/test_world.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

constexpr double kEarthPull = 9.81;  // m/s^2

WorldSettings event_settings() {
  WorldSettings settings;
  settings.precision = engine_tests::test_precision;
  settings.gravity = UniformGravity{{0, 0, -kEarthPull}};
  return settings;
}

std::unique_ptr<Simulation> simulation_of(const WorldDescription& world) {
  auto simulation = Simulation::create(world);
  EXPECT_TRUE(simulation.ok()) << simulation.status();
  (*simulation)->report_contacts(true);
  return std::move(*simulation);
}

void run(Simulation& simulation, int ticks) {
  for (int tick = 0; tick < ticks; ++tick) simulation.step();
}

// A ball of 2 kg in a groove of two faces at right angles, both of one body.
WorldDescription ball_in_groove(double friction) {
  WorldDescription world;
  world.settings = event_settings();
  world.settings.sleep_after = 0;
  WorldBuilder builder(world.settings);
  Shape groove;
  for (const double side : {-1.0, 1.0}) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(side * std::numbers::pi / 4, Eigen::Vector3d::UnitY()));
    groove.parts.push_back({Box{{1, 1, 0.1}}, {turn * Eigen::Vector3d(-side * 0.5, 0, -0.05), turn}});
  }
  const ShapeId ball = builder.shape(Sphere{0.2});
  world = builder.world();
  world.shapes.push_back(groove);
  builder.world() = world;
  builder.add("groove", static_cast<ShapeId>(world.shapes.size() - 1), 1, {0, 0, 0}, Motion::kStatic)
      .properties.friction = friction;
  builder.add("ball", ball, 2, {0, 0, 0.2 * std::numbers::sqrt2}).properties.friction = friction;
  return builder.world();
}

TEST(ContactEvents, EachFaceOfAGrooveBearsItsPart) {
  for (const double friction : {0.0, 0.6}) {
    const WorldDescription world = ball_in_groove(friction);
    const auto simulation = simulation_of(world);
    run(*simulation, 300);
    const std::vector<ContactEvent>& events = simulation->contact_events();
    ASSERT_THAT(events, SizeIs(2));
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();  // N, on the groove, which is a
    for (const ContactEvent& event : events) {
      EXPECT_EQ(event.phase, ContactPhase::kPersist);
      EXPECT_EQ(event.a, BodyId{1});
      ASSERT_THAT(event.points, SizeIs(1));
      EXPECT_EQ(event.points[0].impulse, event.impulse);
      EXPECT_EQ(event.points[0].position, Eigen::Vector3d::Zero());
      EXPECT_NEAR(std::abs(event.normal[0]), std::sqrt(0.5), 1e-4);
      if (friction == 0) {
        EXPECT_NEAR(event.impulse * 60, 2 * kEarthPull * std::sqrt(0.5), 0.01);
      }
      sum += (Eigen::Vector3d(event.normal.data()) * event.impulse + Eigen::Vector3d(event.friction.data())) *
             60;
    }
    EXPECT_NEAR(sum.x(), 0, 0.01);
    EXPECT_NEAR(sum.z(), -2 * kEarthPull, 0.01);
  }
}

TEST(ContactEvents, TheFrictionOfABoxOnASlopeIsItsOwn) {
  WorldSettings settings = event_settings();
  const double slope = 0.3;
  settings.gravity = UniformGravity{{kEarthPull * std::sin(slope), 0, -kEarthPull * std::cos(slope)}};
  settings.sleep_after = 0;
  WorldBuilder builder(settings);
  builder.add_floor(10, 0);
  builder.add("box", builder.shape(Box{{0.4, 0.4, 0.4}}), 3, {0, 0, 0.2});
  const auto simulation = simulation_of(builder.world());
  run(*simulation, 120);
  ASSERT_THAT(simulation->contact_events(), SizeIs(1));
  const ContactEvent& event = simulation->contact_events()[0];
  ASSERT_THAT(event.points, SizeIs(4));
  // On the floor, which is a.
  EXPECT_NEAR(event.friction[0] * 60, 3 * kEarthPull * std::sin(slope), 0.02);
  EXPECT_NEAR(event.friction[1], 0, 1e-4);
  EXPECT_NEAR(event.impulse * 60, 3 * kEarthPull * std::cos(slope), 0.02);
  double impulse = 0;
  for (const TouchingPoint& point : event.points) impulse += point.impulse;
  EXPECT_NEAR(impulse, event.impulse, 1e-6);
}

TEST(ContactEvents, OfPointsThatAreAsDeepItIsAlwaysTheSame) {
  WorldBuilder builder(event_settings());
  builder.add_floor(10, 0);
  builder.add("box", builder.shape(Box{{0.4, 0.4, 0.4}}), 3, {3, -2, 0.2});
  const auto simulation = simulation_of(builder.world());
  for (int tick = 0; tick < 25; ++tick) {
    simulation->step();
    ASSERT_THAT(simulation->contact_events(), SizeIs(1)) << tick;
    EXPECT_NEAR(simulation->contact_events()[0].position.local.x(), 3.2, 1e-3) << tick;
    EXPECT_NEAR(simulation->contact_events()[0].position.local.y(), -1.8, 1e-3) << tick;
  }
}

// Two boxes that sleep on a floor: bodies 2 and 3.
std::unique_ptr<Simulation> two_asleep(double apart, double sector_size) {
  WorldSettings settings = event_settings();
  settings.sector_size = sector_size;
  WorldBuilder builder(settings);
  builder.add_floor(20, 0);
  const ShapeId box = builder.shape(Box{{0.4, 0.4, 0.4}});
  builder.add("one", box, 1, {1, 1, 0.2});
  builder.add("other", box, 1, {1 + apart, 1, 0.2});
  auto simulation = simulation_of(builder.world());
  run(*simulation, 200);
  EXPECT_THAT(simulation->contact_events(), IsEmpty()) << "what sleeps tells of nothing";
  return simulation;
}

void expect_end_of_2(const Simulation& simulation) {
  ASSERT_THAT(simulation.contact_events(), SizeIs(1));
  const ContactEvent& event = simulation.contact_events()[0];
  EXPECT_EQ(event.phase, ContactPhase::kEnd);
  EXPECT_EQ(event.tick, simulation.tick());
  EXPECT_EQ(event.a, BodyId{1});
  EXPECT_EQ(event.b, BodyId{2});
  EXPECT_THAT(event.points, IsEmpty());
}

TEST(ContactEvents, WhatIsRemovedAsleepEndsItsContactsInThatTick) {
  for (const double sector_size : {128.0, 4.0}) {
    for (const int later : {0, 400}) {  // when its sector may have been packed
      const auto simulation = two_asleep(2, sector_size);
      run(*simulation, later);
      const std::vector<Command> remove{RemoveBody{BodyId{2}}};
      simulation->step(remove);
      expect_end_of_2(*simulation);
      for (int tick = 0; tick < 5; ++tick) {
        simulation->step();
        EXPECT_THAT(simulation->contact_events(), IsEmpty()) << "once";
      }
    }
  }
}

TEST(ContactEvents, WhatIsTeleportedAsleepEndsItsContactsInThatTick) {
  for (const double sector_size : {128.0, 4.0}) {
    const auto simulation = two_asleep(2, sector_size);
    Teleport jump{BodyId{2}, {2, 0, 2}, {}};
    const std::vector<Command> commands{jump};
    simulation->step(commands);
    expect_end_of_2(*simulation);
  }
}

TEST(ContactEvents, TheGroundThatIsRemovedEndsTheContactsOfWhatSleepsOnIt) {
  const auto simulation = two_asleep(2, 128);
  const std::vector<Command> remove{RemoveBody{BodyId{1}}};
  simulation->step(remove);
  ASSERT_THAT(simulation->contact_events(), SizeIs(2));
  for (const ContactEvent& event : simulation->contact_events()) EXPECT_EQ(event.phase, ContactPhase::kEnd);
}

}  // namespace
}  // namespace tessera
