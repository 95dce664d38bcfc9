// Relays, and sensors that stand: what programs tell others, and what is measured for bodies that do not
// move.
#include <gtest/gtest.h>

#include <string>

#include "lpss/simulation/program_scenes.h"

namespace tessera {
namespace {

ProgramNumbers watching(absl::string_view kind, absl::string_view value, double place = 0) {
  return {{"program", place}, {"value", place_of(value, find_program(kind)->values()).value()}};
}

ProgramNumbers with(ProgramNumbers numbers, const ProgramNumbers& more) {
  numbers.insert(numbers.end(), more.begin(), more.end());
  return numbers;
}

// A ball falls onto a plate far away from a door, which it opens.
WorldBuilder plate_and_door() {
  WorldBuilder builder(settings_of(4));
  builder.add_floor(50, 0);
  add_box(builder, "door", {1, 0.2, 2}, {9, 0, 1}, Motion::kKinematic)
      .programs.push_back(example_program("mover", {{"z", 2.4}, {"speed", 2}, {"goal", 0}}));
  const auto door = static_cast<double>(builder.world().bodies.size());
  builder.add("ball", builder.shape(Sphere{0.2}), 1, {-5, 0, 2}).programs = {
      example_program("touch"),
      example_program("relay", with(watching("touch", "touches"),
                                    {{"body", door},
                                     {"input", place_of("goal", find_program("mover")->inputs()).value()}}))};
  return builder;
}

TEST(Relay, TellsOnceWhenAValueComesIntoTheRange) {
  const WorldBuilder builder = plate_and_door();
  for (const std::uint32_t partitions : {1u, 4u}) {
    Watched world(builder, partitions);
    world.run(0.3);
    EXPECT_EQ(value_of(world.body("ball"), "inside", 1), 0);
    EXPECT_NEAR(world.position("door").z(), 1, 1e-6);
    world.run(5);
    EXPECT_EQ(value_of(world.body("ball"), "inside", 1), 1);
    EXPECT_EQ(value_of(world.body("ball"), "acts", 1), 1);
    EXPECT_NEAR(world.position("door").z(), 3.4, 1e-3);
  }
}

TEST(Relay, HasTheSameBitsOnAnyPartitions) {
  const WorldBuilder builder = plate_and_door();
  const auto alone = cluster_of(builder.world(), 1);
  expect_the_same_on_any_partitions(builder.world(), hashes_of(*alone, 90));
}

// In the tick in which the altimeter shows it, whichever comes first on the body.
TEST(Relay, SeesWhatTheTickHasLeftInAnyOrder) {
  WorldBuilder builder(settings_of());
  const ProgramNumbers below = {{"least", -100}, {"most", -1}};
  builder.add("after", builder.shape(Sphere{0.2}), 1, {0, 0, 9}).programs = {
      example_program("altimeter"), example_program("relay", with(watching("altimeter", "height"), below))};
  builder.add("before", builder.shape(Sphere{0.2}), 1, {5, 0, 9}).programs = {
      example_program("relay", with(watching("altimeter", "height", 1), below)),
      example_program("altimeter")};
  Watched world(builder);
  for (int tick = 0; tick < 60; ++tick) {
    world.step();
    const bool is_below = value_of(world.body("after"), "height") <= -1;
    EXPECT_EQ(value_of(world.body("after"), "inside", 1), is_below ? 1 : 0) << tick;
    EXPECT_EQ(value_of(world.body("before"), "inside", 0), is_below ? 1 : 0) << tick;
  }
  EXPECT_EQ(value_of(world.body("before"), "acts", 0), 1);
}

TEST(Relay, WaitsToBeToldAndForItsDelayAndSetsSeveralInputs) {
  WorldBuilder builder(settings_of());
  builder.add_floor(50, 0);
  add_box(builder, "slider", {0.5, 0.5, 0.5}, {0, 0, 0.25}, Motion::kKinematic)
      .programs.push_back(
          example_program("relay", {{"delay", 0.5}, {"body", 3}, {"count", 2}, {"to_1", 2}, {"to_2", -1.5}}));
  add_box(builder, "flyer", {0.5, 0.5, 0.5}, {0, 0, 9}, Motion::kDynamic)
      .programs.push_back(example_program("velocity_control"));
  Watched world(builder);
  world.run(1);
  EXPECT_EQ(value_of(world.body("slider"), "acts"), 0);
  world.tell("slider", "fire", 1);
  world.run(0.4);
  EXPECT_EQ(value_of(world.body("slider"), "acts"), 0);
  EXPECT_EQ(world.body("slider").programs[0].inputs[0], 0) << "it may be told again";
  world.run(0.2);
  EXPECT_EQ(value_of(world.body("slider"), "acts"), 1);
  EXPECT_EQ(world.body("flyer").programs[0].inputs[0], 2);
  EXPECT_EQ(world.body("flyer").programs[0].inputs[1], -1.5);
  world.tell("slider", "fire", 1);
  world.run(1);
  EXPECT_EQ(value_of(world.body("slider"), "acts"), 2);
}

TEST(Relay, WithNothingToWatchIsStopped) {
  WorldBuilder builder(settings_of());
  builder.add("ball", builder.shape(Sphere{0.2}), 1, {0, 0, 9}).programs = {
      example_program("relay", {{"program", 3}}), example_program("relay", {{"program", 0}}),
      example_program("touch"), example_program("relay", {{"program", 2}, {"value", 99}})};
  Watched world(builder);
  world.step();
  const BodyRecord ball = world.body("ball");
  EXPECT_EQ(ball.programs[0].fault, "tick 1: program 3, relay, reads others itself");
  EXPECT_EQ(ball.programs[1].fault, "tick 1: program 0, relay, reads others itself");
  EXPECT_EQ(ball.programs[3].fault, "tick 1: program 2, touch, has no value 99");
}

// On bodies that do not move, sensors are programs of one that stands beside.
TEST(StandingSensor, MeasuresForABodyThatDoesNotMove) {
  WorldBuilder builder(settings_of(4));
  add_box(builder, "table", {60, 60, 1}, {0, 0, -0.5}, Motion::kStatic);
  add_box(builder, "post", {0.4, 0.4, 2}, {0, 0, 1}, Motion::kStatic);
  BodyDescription& sensors = add_box(builder, "sensors", {0.1, 0.1, 0.1}, {0, 0, 1}, Motion::kKinematic);
  sensors.properties.category = 0;
  sensors.properties.mask = 0;
  sensors.programs = {example_program("touch", {{"body", 1}}),
                      example_program("ranger", {{"body", 2}, {"rays", 1}, {"most", 20}}),
                      example_program("ranger", {{"body", 2}, {"rays", 1}, {"most", 20}, {"rate", 10}})};
  add_box(builder, "box", {0.5, 0.5, 0.5}, {3, 0, 1.2}, Motion::kDynamic, 2);
  const double box = 4;
  for (const std::uint32_t partitions : {1u, 4u}) {
    Watched world(builder, partitions);
    world.step();
    EXPECT_EQ(value_of(world.body("sensors"), "touches"), 0);
    EXPECT_NEAR(value_of(world.body("sensors"), "nearest", 1), 2.75, 1e-2) << "rays pass through the post";
    world.run(3);
    const BodyRecord body = world.body("sensors");
    EXPECT_EQ(value_of(body, "touches"), 1);
    EXPECT_EQ(value_of(body, "body"), box);
    EXPECT_NEAR(value_of(body, "force"), 2 * kG, 0.1);
    EXPECT_NEAR(value_of(body, "force_z"), -2 * kG, 0.1);
    EXPECT_EQ(value_of(body, "nearest", 1), 20) << "the box has fallen below the ray, and everything sleeps";
    EXPECT_EQ(value_of(body, "nearest", 2), 20);
  }
  const auto alone = cluster_of(builder.world(), 1);
  expect_the_same_on_any_partitions(builder.world(), hashes_of(*alone, 60));
}

TEST(StandingSensor, LooksIntoTheTriggersOfABodyThatDoesNotMove) {
  WorldSettings settings = settings_of(8);
  settings.gravity = UniformGravity{{0, 0, 0}};
  WorldBuilder builder(settings);
  add_box(builder, "view", {10, 10, 10}, {5, 0.2, 0.3}, Motion::kStatic).properties.trigger = true;
  BodyDescription& eye = add_box(builder, "eye", {0.1, 0.1, 0.1}, {0, 0.2, 0.3}, Motion::kKinematic);
  eye.properties.category = 0;
  eye.properties.mask = 0;
  eye.programs = {example_program("logical_camera", {{"body", 1}, {"near", 0.5}, {"far", 8}, {"angle", 1}})};
  builder.add("ball", builder.shape(Sphere{0.2}), 1, {20, 0.2, 0.3}).linear_velocity = {-8, 0, 0};
  for (const std::uint32_t partitions : {1u, 4u}) {
    Watched world(builder, partitions);
    world.run(1);
    EXPECT_EQ(value_of(world.body("eye"), "count"), 0);
    world.run(0.75);
    EXPECT_EQ(value_of(world.body("eye"), "count"), 1);
    EXPECT_NEAR(value_of(world.body("eye"), "x_0"), world.position("ball").x(), 1e-4);
    world.run(1);
    EXPECT_EQ(value_of(world.body("eye"), "count"), 0);
  }
}

}  // namespace
}  // namespace tessera
