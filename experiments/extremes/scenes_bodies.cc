// Ratios of masses, sizes.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "experiments/extremes/figures.h"
#include "experiments/extremes/scene_parts.h"
#include "lpss/model/limits.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera::extremes {
namespace {

// --- masses ---

constexpr double kTolerance = 0.05;  // relative to the size of the stack or chain

// Boxes of 1 m, from the bottom up; `masses` in kg.
WorldDescription stack(const WorldSettings& settings, const std::vector<double>& masses) {
  WorldBuilder builder(settings);
  builder.add_floor(20, 0);
  const ShapeId box = builder.shape(Box{{1, 1, 1}});
  for (std::size_t i = 0; i < masses.size(); ++i) {
    builder.add(absl::StrCat("box", i), box, masses[i], {0, 0, static_cast<double>(i) + 0.5});
  }
  return builder.world();
}

Scene stack_scene(const std::string& name, const std::vector<double>& masses) {
  return {.group = "mass_ratio",
          .name = name,
          .world = [masses](const WorldSettings& settings) { return stack(settings, masses); },
          .lasts = {1200, 300},
          .asks = {farthest, "m moved", kTolerance, "The stack stands.", "The stack sinks, leans or falls."}};
}

constexpr int kLinks = 10;
constexpr double kChain = kLinks * kChainLink;  // m

// Links of 1 kg with a load of `mass` kg at the end, along direction `way` from the world's origin.
WorldDescription loaded_chain(const WorldSettings& settings, double mass, const Eigen::Vector3d& way) {
  WorldBuilder builder(settings);
  const std::string last = builder.add_chain(kLinks, Eigen::Vector3d::Zero(), way);
  builder.add("load", builder.shape(Sphere{0.2}), mass, kChain * way);
  builder.tie("joint of the load", JointType::kBall, last, "load", kChain * way);
  return builder.world();
}

Scene chain_scene(const std::string& name, double mass, const Eigen::Vector3d& way) {
  Scene scene{
      .group = "mass_ratio",
      .name = name,
      .world = [mass, way](const WorldSettings& settings) { return loaded_chain(settings, mass, way); },
      .lasts = {1200, 300}};
  measure_stretch(scene, kChain);
  return scene;
}

void add_mass_ratios(std::vector<Scene>& scenes) {
  for (int power = 0; power <= 6; ++power) {
    const double ratio = std::pow(10, power);
    const std::string name = absl::StrCat("_1:10^", power);
    scenes.push_back(stack_scene("heavy_on_light" + name, {1, ratio}));
    scenes.push_back(stack_scene("light_on_heavy" + name, {ratio, 1}));
    scenes.push_back(stack_scene("heavy_on_four" + name, {1, 1, 1, 1, ratio}));
    scenes.push_back(chain_scene("chain_hangs" + name, ratio, -Eigen::Vector3d::UnitZ()));
    scenes.push_back(chain_scene("chain_swings" + name, ratio, Eigen::Vector3d::UnitX()));
  }
  scenes.push_back(stack_scene("heavy_and_light_in_turns_1:10^2", {1, 100, 1, 100, 1, 100, 1, 100, 1, 100}));
}

// --- sizes ---

constexpr std::array<double, 6> kSizes = {100, 10, 1, 0.1, 0.01, 0.001};  // m

WorldSettings with_wide_sectors(const WorldSettings& given) {
  WorldSettings settings = given;
  settings.sector_size = 512;
  return settings;
}

// kg; with the density of water within the limits on masses.
double mass_of(double size) { return std::clamp(1000 * size * size * size, kMassMin, kMassMax); }

// Cubes of all sizes, side by side or stacked with the largest at the bottom.
WorldDescription cubes(const WorldSettings& given, bool stacked) {
  WorldBuilder builder(with_wide_sectors(given));
  builder.add("ground", builder.shape(Plane{}), 1, Eigen::Vector3d::Zero(), Motion::kStatic);
  double x = 0, below = 0;
  for (const double size : kSizes) {
    const ShapeId cube = builder.shape(Box{Eigen::Vector3d::Constant(size)});
    builder.add(absl::StrCat("cube", size), cube, mass_of(size), {x, 0, below + size / 2});
    if (stacked) below += size;
    if (!stacked) x += size;
  }
  return builder.world();
}

// m; the distance of neighbouring numbers around `place` (m).
double spacing(Precision precision, double place) {
  const int digits = precision == Precision::kFloat32 ? std::numeric_limits<float>::digits
                                                      : std::numeric_limits<double>::digits;
  return std::ldexp(1.0, std::ilogb(place) + 1 - digits);
}

// A cube comes to rest where what would still move it, or the one below, is less than half the spacing of
// numbers at its height: the gap between two may be off by the spacing at the upper one, and a stack by the
// sum.
double stack_rounding(Precision precision, std::size_t cube) {
  double sum = 0, below = 0;
  for (std::size_t i = 0; i <= cube; ++i) {
    sum += spacing(precision, below + kSizes[i] / 2);
    below += kSizes[i];
  }
  return sum;
}

void add_cubes(std::vector<Scene>& scenes, bool stacked) {
  for (std::size_t i = stacked ? 1 : 0; i < kSizes.size(); ++i) {
    Scene scene;
    scene.group = "size";
    scene.name = absl::StrCat("cube_of_", kSizes[i], stacked ? "_m_on_larger_ones" : "_m_beside_others");
    scene.world = [stacked](const WorldSettings& settings) { return cubes(settings, stacked); };
    scene.lasts = {1200, 300};
    scene.asks = {[i](const Moment& start, const Moment& now) {
                    return (now.positions[i] - start.positions[i]).norm() / kSizes[i];
                  },
                  "m moved per m of size", kTolerance, "It stays in place.", "It does not stay in place."};
    if (stacked) {
      scene.rounding = [i](Precision precision) { return stack_rounding(precision, i) / kSizes[i]; };
      scene.rounding_reason = "(Beyond 0.05 the bound is the spacing of numbers below it summed up.)";
    }
    scenes.push_back(scene);
  }
}

constexpr double kThickness = 0.1;  // m, of the beam and the cubes under it

Scene beam() {
  Scene scene;
  scene.group = "size";
  scene.name = "beam_of_100_m_on_cubes_of_0.1_m";
  scene.world = [](const WorldSettings& given) {
    WorldBuilder builder(with_wide_sectors(given));
    builder.add("ground", builder.shape(Plane{}), 1, Eigen::Vector3d::Zero(), Motion::kStatic);
    const ShapeId cube = builder.shape(Box{Eigen::Vector3d::Constant(kThickness)});
    for (const int side : {-1, 1}) {
      builder.add(absl::StrCat("cube", side), cube, 8, {side * 49.9, 0, kThickness / 2});
    }
    builder.add("beam", builder.shape(Box{{100, kThickness, kThickness}}), 8000, {0, 0, 1.5 * kThickness});
    return builder.world();
  };
  scene.lasts = {1200, 300};
  scene.asks = {[](const Moment& start, const Moment& now) { return farthest(start, now) / kThickness; },
                "m moved per m of thickness", kTolerance, "The beam rests on its cubes.",
                "The beam sinks or falls off."};
  return scene;
}

// A coin that is dropped on its edge, tilted, as it rolls and spins.
Scene coin() {
  Scene scene;
  scene.group = "size";
  scene.name = "coin_of_1_cm_by_2_mm_comes_to_rest";
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(settings);
    builder.add_floor(1, 0);
    BodyDescription& coin = builder.add("coin", builder.shape(Cylinder{0.005, 0.002}), 0.00125, {0, 0, 0.02});
    coin.pose.orientation = Eigen::Quaterniond(0.8, 0.5, 0.3, 0.1).normalized();
    coin.linear_velocity = {0.1, 0, 0};
    coin.angular_velocity = {3, 10, 5};
    return builder.world();
  };
  scene.lasts = {600, 600, 0};
  scene.asks = {fastest, "m/s after 10 s", 0, "It sleeps.", "It does not come to rest."};
  return scene;
}

constexpr double kCard = 0.0005;  // m

Scene card() {
  Scene scene;
  scene.group = "size";
  scene.name = "card_of_0.5_mm_lies_on_the_floor";
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(settings);
    builder.add_floor(1, 0);
    builder.add("card", builder.shape(Box{{0.063, 0.088, kCard}}), 0.002, {0, 0, 0.01});
    return builder.world();
  };
  scene.lasts = {600, 600, 0};
  scene.asks = {
      [](const Moment&, const Moment& now) { return std::abs(now.positions[0].z() - kCard / 2) / kCard; },
      "m off the floor per m of thickness", kTolerance, "It lies on the floor.",
      "It lies in the floor or above it."};
  return scene;
}

Scene larger_than_a_sector() {
  const auto world = [](const WorldSettings& settings) {
    WorldBuilder builder(settings);
    builder.add("cube", builder.shape(Box{Eigen::Vector3d::Constant(settings.sector_size)}), 1e6, {0, 0, 0});
    return builder.world();
  };
  return refused_scene("size", "cube_larger_than_a_sector", world,
                       "It runs, although contacts beyond neighbouring sectors would be missed.");
}

}  // namespace

std::vector<Scene> body_scenes() {
  std::vector<Scene> scenes;
  add_mass_ratios(scenes);
  add_cubes(scenes, false);
  add_cubes(scenes, true);
  scenes.push_back(beam());
  scenes.push_back(coin());
  scenes.push_back(card());
  scenes.push_back(larger_than_a_sector());
  return scenes;
}

}  // namespace tessera::extremes
