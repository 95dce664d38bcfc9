// What tests of frames that move have in common.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "lpss/engine/test_world.h"
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

inline int asleep(const Simulation& simulation) {
  int count = 0;
  simulation.for_each_body(
      [&](const BodyRecord& body) { count += body.state.activity == Activity::kAsleep ? 1 : 0; });
  return count;
}

inline void run_for(Simulation& simulation, double seconds) {
  for (long tick = 0; tick < std::lround(seconds / simulation.partition().dt()); ++tick) simulation.step();
}

}  // namespace tessera::frame_scenes
