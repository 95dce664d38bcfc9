// What goes from one frame to another: ships that dock in orbit, a hangar with a door, two trains, and a
// train that leaves its station. Nothing is lost, and bits are the same on any number of servers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "lpss/base/rotation.h"
#include "lpss/model/frame_motion.h"
#include "lpss/simulation/frame_scenes.h"
#include "lpss/simulation/partition_cluster.h"

namespace tessera {
namespace {

using Eigen::Vector3d;
using namespace frame_scenes;

constexpr double kMeetingSector = 8;  // m

using MeetingScript = std::function<std::vector<Command>(int tick)>;

std::vector<WorldHash> hashes_with(const WorldDescription& world, std::uint32_t partitions, int ticks,
                                   const MeetingScript& script) {
  const auto cluster = cluster_of(world, partitions);
  std::vector<WorldHash> hashes;
  for (int tick = 0; tick < ticks; ++tick) {
    cluster->step(script(tick));
    for (Rank rank = 0; rank < partitions; ++rank) check_invariants(cluster->partition(rank));
    hashes.push_back(cluster->hash());
  }
  return hashes;
}

void expect_same_on_partitions(
    const WorldDescription& world, int ticks,
    const MeetingScript& script = [](int) { return std::vector<Command>{}; }) {
  const std::vector<WorldHash> one = hashes_with(world, 1, ticks, script);
  for (const std::uint32_t partitions : {2u, 4u})
    EXPECT_EQ(first_difference(one, hashes_with(world, partitions, ticks, script)), one.size()) << partitions;
}

std::uint64_t id_of(const WorldDescription& world, const std::string& name) {
  const auto found = std::ranges::find(world.bodies, name, &BodyDescription::name);
  EXPECT_TRUE(found != world.bodies.end()) << name;
  return static_cast<std::uint64_t>(found - world.bodies.begin()) + 1;
}

BodyDescription& add_in(WorldBuilder& builder, FrameNumber frame, const std::string& name,
                        const Geometry& geometry, double mass, const Vector3d& place,
                        Motion motion = Motion::kDynamic) {
  BodyDescription& body = builder.add(name, builder.shape(geometry), mass, place, motion);
  body.pose.position.sector.frame = frame;
  return body;
}

bool is_asleep(const BodyRecord& body) { return body.state.activity == Activity::kAsleep; }

// --- ships dock around a planet ---

constexpr double kMeetingRadius = 6.371e6;  // m, of the planet
constexpr double kMeetingOrbit = kMeetingRadius + 4e5;

// Two hulls of 12 m, end to end, each with a frame and somebody aboard who flies to a wall. They fall on a
// circle.
WorldDescription two_ships() {
  WorldSettings settings = settings_of(16);
  settings.sleep_after = 0;
  settings.gravity = CentralGravity{*canonical({}, {-kMeetingOrbit, 0, 0}, 16), kPull, kMeetingRadius};
  for (const std::uint64_t hull : {1, 2}) {
    MovingFrame frame;
    frame.name = "ship" + std::to_string(hull);
    frame.carrier = FrameCarrier{BodyId{hull}, {}};
    settings.frames.push_back(frame);
  }
  WorldBuilder builder(settings);
  const double speed = std::sqrt(kPull * kMeetingRadius * kMeetingRadius / kMeetingOrbit);
  for (const FrameNumber hull : {1u, 2u})
    add_in(builder, kWorldFrame, "hull" + std::to_string(hull), Box{{3, 12, 3}}, 5000,
           {0, 13 * (hull - 1.5), 0})
        .linear_velocity = {0, speed, 0};
  for (const FrameNumber frame : {1u, 2u}) {
    const std::string number = std::to_string(frame);
    add_in(builder, frame, "wall" + number, Box{{3, 1, 3}}, 1, {0, 5, 0}, Motion::kStatic);
    add_in(builder, frame, "crew" + number, Box{{0.5, 0.5, 0.5}}, 80, {0.4, -3, 0.3}).linear_velocity = {0, 2,
                                                                                                         0};
  }
  place_carried(builder.world());
  return builder.world();
}

AddJoint docking() {
  AddJoint joint;
  joint.record.id = JointId{1};
  joint.record.parent_motion = Motion::kDynamic;
  joint.record.properties.type = JointType::kFixed;
  joint.record.properties.parent = BodyId{1};
  joint.record.properties.child = BodyId{2};
  joint.record.properties.in_parent.position = {0, 6.5, 0};
  joint.record.properties.in_child.position = {0, -6.5, 0};
  return joint;
}

std::vector<Command> docks(int tick) {
  return tick == 10 ? std::vector<Command>{docking()} : std::vector<Command>{};
}

TEST(FrameMeetings, ShipsThatDockKeepTheirFramesAndTheirOrbit) {
  const WorldDescription world = two_ships();
  const auto ships = simulation_of(world);
  for (int tick = 0; tick < 900; ++tick) ships->step(docks(tick));
  for (const FrameNumber frame : {1u, 2u}) {
    const BodyRecord crew = body_of(*ships, id_of(world, "crew" + std::to_string(frame)));
    EXPECT_EQ(crew.home.frame, frame);
    EXPECT_GT(place_of(*ships, crew).y(), 3.5) << "it has come to the wall";
  }
  const Vector3d one = seen_from_outside(*ships, body_of(*ships, 1));
  const Vector3d two = seen_from_outside(*ships, body_of(*ships, 2));
  EXPECT_NEAR((two - one).norm(), 13, 1e-3);
  if (engine_tests::test_precision == Precision::kFloat32) return;
  // They fall on the circle, but for the little that the crew has pushed them ahead.
  const double height = ((one + two) / 2 + Vector3d(kMeetingOrbit, 0, 0)).norm() - kMeetingOrbit;
  EXPECT_NEAR(height, 0, 0.03);
}

TEST(FrameMeetings, ShipsThatDockDoNotDependOnServers) { expect_same_on_partitions(two_ships(), 240, docks); }

// What hangs on the world by a joint does not fly: it has the bits that it has in a world without frames.
TEST(FrameMeetings, WhatHangsOnTheWorldHasTheBitsThatItHasWithoutFrames) {
  const auto hanging = [](bool has_frame) {
    WorldSettings settings = settings_of(kMeetingSector);
    settings.gravity =
        CentralGravity{*canonical({}, {0, 0, -kMeetingRadius}, kMeetingSector), kPull, kMeetingRadius};
    if (has_frame) {
      MovingFrame frame;
      frame.name = "ship";
      frame.carrier = FrameCarrier{BodyId{3}, {}};
      settings.frames.push_back(frame);
    }
    WorldBuilder builder(settings);
    builder.add("upper", builder.shape(Box{{1, 0.3, 0.3}}), 3, {0.5, 0, 5});
    builder.add("lower", builder.shape(Box{{1, 0.3, 0.3}}), 2, {1.5, 0, 5});
    builder.add("hull", builder.shape(Box{{2, 2, 2}}), 1000, {50, 0, 50});
    builder.tie("nail", JointType::kBall, "", "upper", {0, 0, 5});
    builder.tie("ring", JointType::kBall, "upper", "lower", {1, 0, 5});
    place_carried(builder.world());
    return builder.world();
  };
  const auto with = simulation_of(hanging(true));
  const auto without = simulation_of(hanging(false));
  for (int tick = 0; tick < 120; ++tick) {
    with->step();
    without->step();
    for (const std::uint64_t id : {1, 2}) {
      ASSERT_EQ(body_of(*with, id).state.position, body_of(*without, id).state.position) << tick;
      ASSERT_EQ(body_of(*with, id).state.linear_velocity, body_of(*without, id).state.linear_velocity)
          << tick;
    }
  }
}

// --- a hangar ---

constexpr double kShipSpeed = 40;    // m/s
constexpr double kDroneSpeed = 4;    // m/s, towards the ship
constexpr int kDoorOpens = 60;       // ticks
const Vector3d kDoorway(8, 0, 1.5);  // m, its middle
const Vector3d kShipPlace(3, -2, 50);

// In space, a ship of 10 t under a hangar in whose front wall is a doorway, with a door; and a drone of 50 kg
// that flies to it.
WorldDescription hangar_and_drone() {
  WorldSettings settings = settings_of(kMeetingSector, Vector3d::Zero());
  MovingFrame frame;
  frame.name = "hangar";
  frame.carrier = FrameCarrier{BodyId{1}, {{0, 0, 1}, Eigen::Quaterniond::Identity()}};
  frame.region = FrameRegion{{3, 0, 2.5}, {18, 8, 6}};
  settings.frames = {frame};
  WorldBuilder builder(settings);
  add_in(builder, kWorldFrame, "hull", Box{{6, 4, 1}}, 1e4, kShipPlace).linear_velocity = {kShipSpeed, 0, 0};
  add_in(builder, kWorldFrame, "drone", Box{{0.6, 0.6, 0.4}}, 50, kShipPlace + Vector3d(14, 0.2, 2.5))
      .linear_velocity = {kShipSpeed - kDroneSpeed, 0, 0};
  add_in(builder, 1, "door", Box{{0.2, 2, 3}}, 1, kDoorway, Motion::kKinematic);
  add_in(builder, 1, "floor", Box{{14, 6, 1}}, 1, {2, 0, -0.5}, Motion::kStatic);
  add_in(builder, 1, "back", Box{{1, 6, 6}}, 1, {-4, 0, 2.5}, Motion::kStatic);
  for (const double side : {-1.0, 1.0})
    add_in(builder, 1, side < 0 ? "right" : "left", Box{{0.4, 2, 5}}, 1, {8, 2 * side, 2.5}, Motion::kStatic);
  place_carried(builder.world());
  return builder.world();
}

// The door goes up, and stops above the doorway.
std::vector<Command> opens(const WorldDescription& world, int tick) {
  const BodyId door{id_of(world, "door")};
  if (tick == kDoorOpens - 60) return {SetVelocity{door, {0, 0, 3}, {}}};
  if (tick == kDoorOpens) return {SetVelocity{door, {}, {}}};
  return {};
}

TEST(FrameMeetings, ADroneFliesIntoAHangarThroughItsDoor) {
  for (const bool is_open : {true, false}) {
    const WorldDescription world = hangar_and_drone();
    const auto ship = simulation_of(world);
    const Momentum before = momentum_of(*ship);
    const std::uint64_t drone = id_of(world, "drone");
    int crossings = 0;
    FrameNumber frame = kWorldFrame;
    for (int tick = 0; tick < 330; ++tick) {
      ship->step(is_open ? opens(world, tick) : std::vector<Command>{});
      const FrameNumber now = body_of(*ship, drone).home.frame;
      crossings += now != frame ? 1 : 0;
      frame = now;
    }
    EXPECT_EQ(frame, 1u);
    EXPECT_EQ(crossings, 1);
    const Vector3d place = place_of(*ship, body_of(*ship, drone));
    EXPECT_NEAR(place.x(), is_open ? -3.2 : 8.4, 0.5) << "at the back wall, or at the door";
    EXPECT_LT((momentum_of(*ship).linear - before.linear).norm(), 1e-6 * before.linear.norm());
    const double together = (1e4 * kShipSpeed + 50 * (kShipSpeed - kDroneSpeed)) / 10050;
    EXPECT_NEAR(body_of(*ship, 1).state.linear_velocity[0], together, 1e-3);
  }
}

TEST(FrameMeetings, TheHangarDoesNotDependOnServers) {
  const WorldDescription world = hangar_and_drone();
  expect_same_on_partitions(world, 330, [&](int tick) { return opens(world, tick); });
}

// --- trains ---

MovingFrame train_at(const std::string& name, const Vector3d& place, double speed,
                     const std::vector<FrameLeg>& legs = {}) {
  MovingFrame frame;
  frame.name = name;
  frame.start.position = *canonical({}, place, kMeetingSector);
  frame.velocity = {speed, 0, 0};
  frame.legs = legs;
  frame.region = FrameRegion{{0, 0, 2}, {30, 4, 5}};
  return frame;
}

constexpr double kSlower = 30;  // m/s
constexpr double kFaster = 32;
const Vector3d kThrownFrom(-2, 0, 1.5);  // m, in the slower train
const Vector3d kThrown(1, 8, 4);         // m/s, likewise

// Side by side; a crate is thrown from one to the other, which has a wall on the far side.
WorldDescription two_trains() {
  WorldSettings settings = settings_of(kMeetingSector);
  settings.frames = {train_at("slower", {0, 0, 1}, kSlower), train_at("faster", {0, 8, 1}, kFaster)};
  WorldBuilder builder(settings);
  for (const FrameNumber frame : {1u, 2u})
    add_in(builder, frame, "floor" + std::to_string(frame), Box{{30, 4, 1}}, 1, {0, 0, -0.5}, Motion::kStatic)
        .properties.friction = 1;
  add_in(builder, 2, "wall", Box{{30, 0.4, 4}}, 1, {0, 1.8, 2}, Motion::kStatic);
  BodyDescription& crate = add_in(builder, 1, "crate", Box{{0.4, 0.4, 0.3}}, 10, kThrownFrom);
  crate.linear_velocity = kThrown;
  crate.properties.friction = 1;
  return builder.world();
}

TEST(FrameMeetings, ACrateIsThrownFromOneTrainToAnother) {
  const WorldDescription world = two_trains();
  const auto trains = simulation_of(world);
  const std::uint64_t crate = id_of(world, "crate");
  std::vector<FrameNumber> frames = {1};
  for (int tick = 1; tick <= 480; ++tick) {
    trains->step();
    const BodyRecord body = body_of(*trains, crate);
    if (body.home.frame != frames.back()) frames.push_back(body.home.frame);
    if (frames.size() == 3) continue;
    const double time = tick * trains->partition().dt();
    const Vector3d right = Vector3d(0, 0, 1) + kThrownFrom + (kThrown + Vector3d(kSlower, 0, 0)) * time -
                           Vector3d(0, 0, kPull * time * time / 2);
    ASSERT_LT((seen_from_outside(*trains, body) - right).norm(), 2e-4) << tick;
  }
  EXPECT_EQ(frames, (std::vector<FrameNumber>{1, kWorldFrame, 2}));
  const BodyRecord body = body_of(*trains, crate);
  EXPECT_TRUE(is_asleep(body)) << "aboard the faster one";
  EXPECT_LT(place_of(*trains, body).z(), 0.25);
}

TEST(FrameMeetings, TheThrowDoesNotDependOnServers) { expect_same_on_partitions(two_trains(), 300); }

// A train stands for a second and leaves. Its floor and the platform lie side by side and overlap at the edge
// of its region, at y = -2.
struct OnTheEdge {
  std::string name;
  FrameNumber starts;  // in this frame
  double y;            // m
  FrameNumber ends;
};

const std::vector<OnTheEdge>& on_the_edge() {
  static const std::vector<OnTheEdge> all = {
      {"on_platform", kWorldFrame, -3, kWorldFrame},
      {"just_outside", kWorldFrame, -2.05, kWorldFrame},
      {"just_inside", kWorldFrame, -1.95, kWorldFrame},
      {"inside", kWorldFrame, -1.8, 1},
      {"aboard", 1, 0, 1},
      {"aboard_inside", 1, -1.95, 1},
      {"aboard_outside", 1, -2.05, 1},
      {"left_behind", 1, -2.2, kWorldFrame},
  };
  return all;
}

WorldDescription train_and_platform() {
  WorldSettings settings = settings_of(kMeetingSector);
  settings.frames = {train_at("train", {0, 0, 0}, 0, {{1, Vector3d::Zero()}, {4, {2, 0, 0}}})};
  WorldBuilder builder(settings);
  add_in(builder, 1, "floor", Box{{30, 5, 1}}, 1, {0, 0, -0.5}, Motion::kStatic);
  add_in(builder, kWorldFrame, "platform", Box{{60, 10.5, 1}}, 1, {0, -6.75, -0.5}, Motion::kStatic);
  for (std::size_t n = 0; n < on_the_edge().size(); ++n) {
    const OnTheEdge& edge = on_the_edge()[n];
    add_in(builder, edge.starts, edge.name, Box{{0.4, 0.4, 0.4}}, 5,
           {1.5 * static_cast<double>(n) - 6, edge.y, 0.2});
  }
  return builder.world();
}

TEST(FrameMeetings, ATrainLeavesWithWhoIsAboard) {
  const WorldDescription world = train_and_platform();
  const auto train = simulation_of(world);
  run_for(*train, 12);
  for (const OnTheEdge& edge : on_the_edge()) {
    const std::uint64_t id = id_of(world, edge.name);
    const BodyRecord body = body_of(*train, id);
    EXPECT_EQ(body.home.frame, edge.ends) << edge.name;
    EXPECT_TRUE(is_asleep(body)) << edge.name;
    const WorldPosition& position = world.bodies[id - 1].pose.position;
    const Vector3d start = relative_to(position, {0, 0, 0, edge.starts}, kMeetingSector);
    EXPECT_LT((place_of(*train, body) - start).norm(), 1e-3) << edge.name << ": where it stood";
  }
  EXPECT_EQ(bodies_of(*train).size(), on_the_edge().size());
}

TEST(FrameMeetings, TheStationDoesNotDependOnServers) {
  expect_same_on_partitions(train_and_platform(), 400);
}

}  // namespace
}  // namespace tessera
