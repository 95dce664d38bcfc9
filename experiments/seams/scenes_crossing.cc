// Scenes 6 and 7: bodies that rest on a seam, cross it repeatedly, extend over a corner, or are shot through
// sectors.
#include <cmath>

#include "experiments/seams/scene.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera::seams {
namespace {

WorldSettings weightless(WorldSettings settings) {
  settings.gravity = UniformGravity{Eigen::Vector3d::Zero()};
  settings.sleep_after = 0;
  return settings;
}

// Exactly on the seam, on purpose: its centre is on a vertical seam, its bottom on a horizontal one.
WorldDescription resting(const WorldSettings& settings) {
  WorldBuilder builder(settings);
  builder.add("floor", builder.shape(Box{{100, 100, 2}}), 1, {0, 0, -1}, Motion::kStatic);
  builder.add("box", builder.shape(Box{{1, 1, 1}}), 1, {0, 0, 0.5});
  return builder.world();
}

constexpr double kWall = 0.2;  // m from the seam

// A hard ball between two hard walls: 0.2 m of room for its centre, at 0.17 m per tick.
WorldDescription to_and_fro(const WorldSettings& settings) {
  WorldBuilder builder(weightless(settings));
  const ShapeId wall = builder.shape(Box{{0.4, 1, 1}});
  for (const int side : {-1, 1}) {
    builder.add(side < 0 ? "left" : "right", wall, 1, {side * (kWall + 0.2), 0, 0}, Motion::kStatic)
        .properties.restitution = 1;
  }
  BodyDescription& ball = builder.add("ball", builder.shape(Sphere{0.1}), 1, {0.013, 0, 0});
  ball.properties.restitution = 1;
  ball.linear_velocity.x() = 10.3;
  return builder.world();
}

bool stays_between_walls(const Course& run, const Course&) {
  const Sample& ball = run.end.front();
  return std::abs(ball.position.x()) < kWall && std::abs(ball.linear_velocity.x()) > 1;
}

// A rod of 8 m rotates about a corner in free space and hits a ball.
WorldDescription spinning_rod(const WorldSettings& settings) {
  WorldBuilder builder(weightless(settings));
  BodyDescription& rod = builder.add("rod", builder.shape(Box{{8, 0.2, 0.2}}), 2, {0.013, 0.021, 0.017});
  rod.angular_velocity = {0.1, 0.2, 3};
  rod.linear_velocity = {0.03, -0.02, 0.01};
  builder.add("ball", builder.shape(Sphere{0.3}), 0.5, {2.9, 2.13, 0.05});
  return builder.world();
}

constexpr double kTarget = 60.3;  // m

WorldDescription shot(const WorldSettings& settings) {
  WorldBuilder builder(settings);
  builder.add("wall", builder.shape(Box{{0.2, 40, 40}}), 1, {kTarget + 0.1, 0, 0}, Motion::kStatic);
  BodyDescription& bullet = builder.add("bullet", builder.shape(Sphere{0.1}), 1, {-130, 0.4, 0.3});
  bullet.linear_velocity.x() = 1000;
  return builder.world();
}

bool is_stopped(const Course& run, const Course&) {
  return run.highest.front().x() < kTarget && run.contact_begins > 0;
}

Scene scene_of(const std::string& name, const std::string& about) {
  Scene scene;
  scene.name = name;
  scene.about = about;
  return scene;
}

}  // namespace

std::vector<Scene> crossing_scenes() {
  Scene rest = scene_of("rest", "a box that rests exactly on the seam");
  rest.extent = 2;
  rest.energy = EnergyRule::kNoGain;
  rest.build = resting;
  rest.stands = [](const Course& run, const Course&) {
    return displacement(run) < 1e-3 && all_asleep(run.end);
  };

  Scene cross = scene_of("to_and_fro", "a ball that crosses the seam almost every tick, between two walls");
  cross.sector_size = 2;
  cross.extent = 2;
  cross.energy = EnergyRule::kNoGain;
  cross.build = to_and_fro;
  cross.stands = stays_between_walls;

  Scene rod = scene_of("rod", "a rod of 8 m that spins across the seam and hits a ball");
  rod.sector_size = 10;
  rod.extent = 12;
  rod.free = true;
  rod.build = spinning_rod;
  rod.stands = [](const Course& run, const Course& reference) {
    return run.contact_begins > 0 && reference.contact_begins > 0 && run.momentum_drift < 1e-3;
  };

  Scene bullet = scene_of("shot", "a ball of 0.1 m at 1000 m/s through four sectors of 64 m into a wall");
  bullet.sector_size = 64;
  bullet.reference_size = 512;
  bullet.extent = 135;
  bullet.build = shot;
  bullet.stands = is_stopped;
  return {rest, cross, rod, bullet};
}

}  // namespace tessera::seams
