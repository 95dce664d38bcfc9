#include "lpss/simulation/plain_world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace tessera {
namespace {

// A tower of five crates on a plane, `metres` along x from the anchor.
WorldDescription tower_at(double metres) {
  WorldDescription world;
  world.shapes = {Shape{{ShapePart{Plane{}, Pose{}}}}, Shape{{ShapePart{Box{}, Pose{}}}}};
  world.bodies.emplace_back();
  world.bodies.back().name = "ground";
  world.bodies.back().properties.motion = Motion::kStatic;
  for (int level = 0; level < 5; ++level) {
    world.bodies.emplace_back();
    BodyDescription& crate = world.bodies.back();
    crate.name = "crate_" + std::to_string(level);
    crate.properties.shape = 1;
    crate.properties.mass = 6;
    crate.pose.position = canonical({}, {metres, 0, 0.5 + level}, world.settings.sector_size).value();
  }
  return world;
}

// How far (m) a body of the tower ends from where the world puts it, at most; infinite for what is no number.
double displacement_of(const WorldDescription& world, int ticks) {
  const std::unique_ptr<PlainWorld> plain = PlainWorld::create(world, Precision::kFloat32).value();
  std::vector<Eigen::Vector3d> start;
  for (const BodyDescription& body : world.bodies) {
    if (body.properties.motion == Motion::kStatic) continue;
    const WorldPosition& place = body.pose.position;
    start.push_back(metres_between(world.anchor, place.sector, world.settings.sector_size) + place.local);
  }
  for (int tick = 0; tick < ticks; ++tick) plain->step();
  std::vector<Eigen::Vector3d> end;
  plain->for_each_body([&](const BodyRecord& record) { end.emplace_back(record.state.position.data()); });
  double largest = 0;
  for (std::size_t i = 0; i < start.size(); ++i) {
    const double moved = (end[i] - start[i]).norm();
    largest = std::isfinite(moved) ? std::max(largest, moved) : std::numeric_limits<double>::infinity();
  }
  return largest;
}

TEST(PlainWorldTest, TowerStandsNearTheOriginAndNotFarAway) {
  const double near = displacement_of(tower_at(0), 120);
  EXPECT_LT(near, 0.05);
  EXPECT_GT(displacement_of(tower_at(6.4e6 + 0.3), 120), 2 * near);
}

TEST(PlainWorldTest, BodiesFallAsleepTogether) {
  const std::unique_ptr<PlainWorld> plain = PlainWorld::create(tower_at(0), Precision::kFloat32).value();
  for (int tick = 0; tick < 600; ++tick) plain->step();
  plain->for_each_body([](const BodyRecord& record) { EXPECT_EQ(record.state.activity, Activity::kAsleep); });
}

}  // namespace
}  // namespace tessera
