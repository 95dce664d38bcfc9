// Runs of very many ticks.
#include <absl/strings/str_cat.h>

#include <cmath>

#include "experiments/extremes/figures.h"
#include "experiments/extremes/scene_parts.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera::extremes {
namespace {

constexpr Tick kTicks = 1'000'000;
constexpr Tick kQuickTicks = 20'000;
constexpr Tick kSettled = 600;  // ticks

Scene long_scene(const std::string& name, Build world) {
  return {.group = "long_run",
          .name = name,
          .world = [world = std::move(world)](const WorldSettings& given) { return world(sleepless(given)); },
          .lasts = {kTicks, kQuickTicks, 1000, kSettled}};
}

// Starts after it has settled: nothing pushes it, so it must not move.
Scene rest_scene(const std::string& name, int boxes) {
  Scene scene = long_scene(name, [boxes](const WorldSettings& settings) {
    return tower_world(settings, boxes, Eigen::Vector3d::Zero());
  });
  scene.asks = {farthest, "m crept", 0.01, "It stays in place.", "It creeps, although nothing pushes it."};
  return scene;
}

constexpr double kSwing = 0.25;  // m, height of the pendulum's centre at the start above its lowest point

Scene pendulum_scene() {
  Scene scene = long_scene("pendulum_keeps_its_energy", [](const WorldSettings& settings) {
    return chain_world(settings, 1, {0, 0, kSwing});
  });
  scene.lasts.warm_up = 0;
  scene.asks = {energy_change(kStandardGravity), "relative energy change", 0.05, "It keeps its energy.",
                "Its energy changes."};
  return scene;
}

// A ball between two walls on either side of a border: its home changes, clones and contacts come and go.
Scene memory_scene() {
  Scene scene = long_scene("ball_over_a_seam_keeps_its_memory", [](const WorldSettings& given) {
    WorldBuilder builder(weightless(given));
    const double border = given.sector_size / 2;
    builder.add_floor(5, border - 2);
    builder.add_floor(5, border + 4);
    builder.add("ball", builder.shape(Sphere{0.5}), 1, {0, 0, border}).linear_velocity.z() = 7;
    for (BodyDescription& body : builder.world().bodies) body.properties.restitution = 1;
    return builder.world();
  });
  scene.lasts.warm_up = kQuickTicks / 4;
  scene.asks.figure = [](const Moment& start, const Moment& now) {
    return (static_cast<double>(now.heap_bytes) - static_cast<double>(start.heap_bytes)) / 1000;
  };
  scene.asks.unit = "kB more";
  scene.asks.bound = 64;  // room for allocators and growing hash tables, but less than one byte per tick
  scene.asks.holds = "Its memory does not grow over time.";
  scene.asks.fails = "Its memory keeps growing.";
  return scene;
}

}  // namespace

std::vector<Scene> long_scenes() {
  return {rest_scene("box_at_rest", 1), rest_scene("tower_of_5_at_rest", 5), pendulum_scene(),
          memory_scene()};
}

}  // namespace tessera::extremes
