// Stacks and piles: time steps, gravity, heights, overlaps, crowds.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "experiments/extremes/figures.h"
#include "experiments/extremes/scene_parts.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera::extremes {
namespace {

constexpr double kStandingMax = 0.5;  // m: half a box; a box that moves further has fallen or will fall

// A tower of boxes of 1 m for 10 s.
Scene tower_scene(const std::string& group, const std::string& name, const WorldSettings& changed,
                  int boxes) {
  Scene scene;
  scene.group = group;
  scene.name = name;
  scene.world = with_settings(changed, [boxes](const WorldSettings& settings) {
    return tower_world(settings, boxes, Eigen::Vector3d::Zero());
  });
  scene.lasts = {static_cast<Tick>(std::lround(10 / changed.time_step)),
                 static_cast<Tick>(std::lround(10 / changed.time_step)), 10};
  scene.asks = {farthest, "m moved", kStandingMax, "The tower stands.",
                "The tower falls, sinks or flies apart."};
  return scene;
}

// --- time steps ---

// First-order integration of a fall is off by g t dt / 2.
Scene fall_scene(const std::string& name, const WorldSettings& changed) {
  Scene scene;
  scene.group = "time_step";
  scene.name = absl::StrCat("fall_", name);
  scene.world = with_settings(changed, [](const WorldSettings& settings) {
    WorldBuilder builder(settings);
    builder.add("ball", builder.shape(Sphere{0.5}), 1, Eigen::Vector3d::Zero());
    return builder.world();
  });
  scene.lasts = {static_cast<Tick>(std::lround(1 / changed.time_step)),
                 static_cast<Tick>(std::lround(1 / changed.time_step))};
  scene.asks = {[](const Moment&, const Moment& now) {
                  return std::abs(now.positions[0].z() + 0.5 * kStandardGravity * now.time * now.time);
                },
                "m off the parabola", kStandardGravity * changed.time_step,
                "It falls as far as first-order integration allows.", "It falls too far or not far enough."};
  return scene;
}

Scene swing_scene(const std::string& name, const WorldSettings& changed) {
  constexpr int kLinks = 5;
  constexpr double kLength = kChainLink * kLinks - kChainLink / 2;  // m, to the centre of the last link
  Scene scene;
  scene.group = "time_step";
  scene.name = absl::StrCat("chain_", name);
  scene.world = with_settings(changed, [](const WorldSettings& settings) {
    return chain_world(settings, kLinks, Eigen::Vector3d::Zero());
  });
  scene.lasts = {static_cast<Tick>(std::lround(5 / changed.time_step)),
                 static_cast<Tick>(std::lround(5 / changed.time_step))};
  measure_stretch(scene, kLength);
  return scene;
}

void add_time_steps(std::vector<Scene>& scenes) {
  for (const int rate : {15, 30, 60, 240, 1000}) {
    WorldSettings settings;
    settings.time_step = 1.0 / rate;
    const std::string name = absl::StrCat("at_1/", rate, "_s");
    scenes.push_back(tower_scene("time_step", absl::StrCat("tower_", name), settings, 10));
    scenes.push_back(fall_scene(name, settings));
    scenes.push_back(swing_scene(name, settings));
  }
}

// --- gravity ---

void add_gravities(std::vector<Scene>& scenes) {
  for (const double multiple : {0.0, 0.01, 1.0, 10.0, 100.0}) {
    WorldSettings settings;
    settings.gravity = UniformGravity{{0, 0, -multiple * kStandardGravity}};
    scenes.push_back(tower_scene("gravity", absl::StrCat("tower_at_", multiple, "_g"), settings, 5));
    Scene box = tower_scene("gravity", absl::StrCat("box_at_", multiple, "_g"), settings, 1);
    box.asks = {farthest, "m moved", 0.05, "The box lies on the floor.",
                "The box does not stay on the floor."};
    scenes.push_back(box);
  }
}

// --- overlaps ---

// m/s: the impact speed after a fall from the height of a body or of a crowd. Overlaps must not throw bodies
// faster than that.
double fall_speed(double height) { return std::sqrt(2 * kStandardGravity * height); }

struct Start {
  Geometry shape;  // about 1 m across
  int count = 2;
  Eigen::Vector3d apart = Eigen::Vector3d::Zero();  // m, between successive bodies
  bool in_floor = false;                            // a floor 2 m thick with its top at 0
  Eigen::Vector3d first = Eigen::Vector3d::Zero();  // m
  double gravity = 0;                               // m/s^2
};

WorldDescription overlapping(const WorldSettings& given, const Start& start) {
  WorldSettings settings = given;
  settings.gravity = UniformGravity{{0, 0, -start.gravity}};
  WorldBuilder builder(settings);
  if (start.in_floor) builder.add_floor(20, 0);
  const ShapeId shape = builder.shape(start.shape);
  for (int i = 0; i < start.count; ++i)
    builder.add(absl::StrCat("body", i), shape, 1, start.first + i * start.apart);
  return builder.world();
}

Scene overlap_scene(const std::string& name, const Start& start) {
  return {
      .group = "overlap",
      .name = absl::StrCat(name, "_are_not_thrown"),
      .world = [start](const WorldSettings& settings) { return overlapping(settings, start); },
      .lasts = {600, 600},
      .asks = {fastest, "m/s", fall_speed(1), "They separate gently, or stay.", "They are thrown apart."}};
}

// The deepest overlap of two of the given balls at the end.
Scene parting_scene(const std::string& name, const Start& start) {
  Scene scene = overlap_scene(name, start);
  scene.name = absl::StrCat(name, "_part");
  scene.lasts.sample_every = 0;
  scene.asks = {[diameter = 2 * std::get<Sphere>(start.shape).radius](const Moment&, const Moment& now) {
                  double nearest = std::numeric_limits<double>::infinity();
                  for (std::size_t i = 0; i < now.positions.size(); ++i) {
                    for (std::size_t j = 0; j < i; ++j)
                      nearest = std::min(nearest, (now.positions[i] - now.positions[j]).norm());
                  }
                  return std::max(0.0, diameter - nearest);
                },
                "m of overlap left", 0.05, "They end side by side.", "They stay inside each other."};
  return scene;
}

// A body that starts half inside the floor, under gravity.
Scene rising_scene(const std::string& name, const Geometry& shape) {
  Scene scene = overlap_scene(name, {shape, 1, {}, true, {0, 0, 0}, kStandardGravity});
  scene.name = absl::StrCat(name, "_half_in_the_floor_comes_out");
  scene.lasts.sample_every = 0;
  scene.asks = {[](const Moment&, const Moment& now) { return std::abs(now.positions[0].z() - 0.5); },
                "m from resting on it", 0.05, "It ends on the floor.", "It does not end on the floor."};
  return scene;
}

void add_overlaps(std::vector<Scene>& scenes) {
  const std::pair<const char*, Geometry> shapes[] = {{"boxes", Box{{1, 1, 1}}}, {"balls", Sphere{0.5}}};
  for (const auto& [name, shape] : shapes) {
    const auto named = [plural = name](const char* what) { return absl::StrCat(what, "_", plural); };
    scenes.push_back(overlap_scene(named("two_half_in_each_other"), {shape, 2, {0.5, 0.1, 0.05}}));
    scenes.push_back(overlap_scene(named("two_in_the_same_place"), {shape, 2}));
    scenes.push_back(overlap_scene(named("ten_in_the_same_place"), {shape, 10}));
    scenes.push_back(overlap_scene(named("one_of_the_inside_the_floor"), {shape, 1, {}, true, {0, 0, -0.9}}));
    scenes.push_back(
        overlap_scene(named("one_of_the_half_in_the_floor"), {shape, 1, {}, true, {}, kStandardGravity}));
    scenes.push_back(rising_scene(named("one_of_the"), shape));
  }
  scenes.push_back(parting_scene("two_half_in_each_other_balls", {Sphere{0.5}, 2, {0.5, 0.1, 0.05}}));
  scenes.push_back(parting_scene("two_in_the_same_place_balls", {Sphere{0.5}, 2}));
  scenes.push_back(parting_scene("ten_in_the_same_place_balls", {Sphere{0.5}, 10}));
}

// Balls of 0.2 m at one point; as a heap they would fill a ball of about `size` m.
Scene crowd_scene(int count, double size, Tick ticks, Tick quick_ticks) {
  Scene scene = overlap_scene("", {Sphere{0.1}, count});
  scene.group = "crowd";
  scene.name = absl::StrCat(count, "_balls_in_one_point");
  scene.lasts = {ticks, quick_ticks};
  scene.asks.bound = fall_speed(size);
  return scene;
}

}  // namespace

std::vector<Scene> pile_scenes() {
  std::vector<Scene> scenes;
  add_time_steps(scenes);
  add_gravities(scenes);
  for (const int boxes : {5, 10, 15, 20, 30, 40}) {
    scenes.push_back(tower_scene("height", absl::StrCat("tower_of_", boxes), WorldSettings(), boxes));
  }
  add_overlaps(scenes);
  scenes.push_back(crowd_scene(100, 1.1, 300, 120));
  scenes.push_back(crowd_scene(1000, 2.3, 8, 1));
  return scenes;
}

}  // namespace tessera::extremes
