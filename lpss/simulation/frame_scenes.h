// What tests of frames that move have in common.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lpss/engine/test_world.h"
#include "lpss/model/frame_motion.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/simulation.h"
#include "lpss/simulation/test_runs.h"

namespace tessera::frame_scenes {

using Eigen::Vector3d;

inline constexpr double kPull = 9.81;  // m/s^2

inline WorldSettings settings_of(double sector_size, const Vector3d& gravity = {0, 0, -kPull}) {
  WorldSettings settings = sectors_of(sector_size);
  settings.precision = engine_tests::test_precision;
  settings.gravity = UniformGravity{gravity};
  return settings;
}

inline MovingFrame frame_at(const Vector3d& velocity, const Vector3d& spin = Vector3d::Zero()) {
  MovingFrame frame;
  frame.name = "ship";
  frame.start.position.sector = {5, -3, 1 << 20};
  frame.velocity = velocity;
  frame.spin = spin;
  return frame;
}

inline std::unique_ptr<Simulation> simulation_of(const WorldDescription& world) {
  auto simulation = Simulation::create(world);
  EXPECT_TRUE(simulation.ok()) << simulation.status();
  return std::move(*simulation);
}

inline BodyRecord body_of(const Simulation& simulation, std::uint64_t id) {
  std::optional<BodyRecord> found;
  simulation.for_each_body([&](const BodyRecord& body) {
    if (body.id.value == id) found = body;
  });
  EXPECT_TRUE(found);
  return found.value_or(BodyRecord{});
}

// m, from the origin of the frame that the body is in.
inline Vector3d place_of(const Simulation& simulation, const BodyRecord& body) {
  return metres_between({0, 0, 0, body.home.frame}, body.home, simulation.partition().sector_size()) +
         Vector3d(body.state.position.data());
}

inline std::vector<WorldHash> hashes_of(const WorldDescription& world, std::uint32_t partitions, int ticks) {
  return run(world, partitions, /*threads=*/1, ticks);
}

// All bodies of a world to those of another one.
inline void add_all(const WorldDescription& from, WorldDescription& to) {
  const auto shapes = static_cast<ShapeId>(to.shapes.size());
  to.shapes.insert(to.shapes.end(), from.shapes.begin(), from.shapes.end());
  for (BodyDescription body : from.bodies) {
    body.properties.shape += shapes;
    to.bodies.push_back(std::move(body));
  }
}

inline void expect_same_bits_on_servers(const WorldDescription& world) {
  constexpr int kTicks = 150;
  const std::vector<WorldHash> one = hashes_of(world, 1, kTicks);
  for (const std::uint32_t partitions : {2u, 4u, 9u})
    EXPECT_EQ(first_difference(one, hashes_of(world, partitions, kTicks)), one.size()) << partitions;
}

// --- carriers, and what is aboard ---

inline void tumble(BodyDescription& hull) {
  hull.linear_velocity = {20, 3, 9};
  hull.angular_velocity = {0.1, 0.3, -0.2};
}

inline BodyDescription& add_floor(WorldBuilder& builder, double friction = 0.5) {
  BodyDescription& floor =
      builder.add("floor", builder.shape(Box{{30, 30, 1}}), 1, {0, 0, -0.5}, Motion::kStatic);
  floor.properties.friction = friction;
  return floor;
}

inline void add_stack(WorldBuilder& builder) {
  add_floor(builder);
  const ShapeId box = builder.shape(Box{{0.5, 0.5, 0.5}});
  for (int n = 0; n < 4; ++n)
    builder.add("box" + std::to_string(n), box, 5, {0.05 * (n % 2), 0.02 * n, 0.25 + 0.52 * n});
}

inline void add_stack_and_thrown(WorldBuilder& builder) {
  add_stack(builder);
  builder.add("thrown", builder.shape(Sphere{0.2}), 1, {2, 0, 2}).linear_velocity = {4, 5, 3};
}

inline int asleep(const Simulation& simulation) {
  int count = 0;
  simulation.for_each_body(
      [&](const BodyRecord& body) { count += body.state.activity == Activity::kAsleep ? 1 : 0; });
  return count;
}

inline void run_for(Simulation& simulation, double seconds) {
  for (long tick = 0; tick < std::lround(seconds / simulation.partition().dt()); ++tick) simulation.step();
}

inline std::vector<BodyRecord> bodies_of(const Simulation& simulation) {
  std::vector<BodyRecord> bodies;
  simulation.for_each_body([&](const BodyRecord& body) { bodies.push_back(body); });
  return bodies;
}

// A body in sectors of the world frame.
inline FramedBody outside(const Simulation& simulation, const BodyRecord& body) {
  FramedBody seen{body.home, body.state};
  const Partition& partition = simulation.partition();
  const double time = static_cast<double>(simulation.tick()) * partition.dt();
  while (seen.home.frame != kWorldFrame) {
    const auto carried = std::ranges::find(partition.carried, seen.home.frame, &CarriedFrame::frame);
    const FramePlace place = carried != partition.carried.end()
                                 ? carried->place
                                 : *frame_place(partition.settings, seen.home.frame, time);
    seen = *out_of_frame(place, seen, partition.sector_size());
  }
  return seen;
}

// m, of a point of a body from the origin of the world; the point relative to its centre, along its axes.
inline Vector3d seen_from_outside(const Simulation& simulation, const BodyRecord& body,
                                  const Vector3d& point = Vector3d::Zero()) {
  const FramedBody seen = outside(simulation, body);
  const Vector3d local = Vector3d(seen.state.position.data()) + quaternion_of(seen.state) * point;
  return relative_to({seen.home, local}, {}, simulation.partition().sector_size());
}

struct Momentum {
  Vector3d linear = Vector3d::Zero();   // kg m/s
  Vector3d angular = Vector3d::Zero();  // kg m^2/s, about the origin of the world
};

// Of all bodies, seen from outside.
inline Momentum momentum_of(const Simulation& simulation) {
  Momentum sum;
  for (const BodyRecord& body : bodies_of(simulation)) {
    const BodyState state = outside(simulation, body).state;
    const Vector3d momentum = body.properties.mass * Vector3d(state.linear_velocity.data());
    const Eigen::Matrix3d axes = quaternion_of(state).toRotationMatrix();
    const Vector3d moments(body.properties.inertia.data());
    sum.linear += momentum;
    sum.angular += seen_from_outside(simulation, body).cross(momentum) +
                   axes * moments.asDiagonal() * axes.transpose() * Vector3d(state.angular_velocity.data());
  }
  return sum;
}

}  // namespace tessera::frame_scenes
