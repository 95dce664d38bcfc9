// Scene 2: stacks.
#include <absl/strings/str_cat.h>

#include <cmath>
#include <numbers>

#include "experiments/seams/scene.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera::seams {
namespace {

constexpr double kStandingDisplacementMax = 0.25;  // m

bool stands_still(const Course& run, const Course&) { return displacement(run) < kStandingDisplacementMax; }

// Ten boxes centred at the origin, `width` m wide and slightly offset in proportion.
WorldDescription slim_tower(const WorldSettings& settings, double width) {
  WorldBuilder builder(settings);
  builder.add("floor", builder.shape(Box{{100, 100, 2}}), 1, {0, 0, -6}, Motion::kStatic);
  const ShapeId box = builder.shape(Box{{width, width, 1}});
  for (int i = 0; i < 10; ++i) {
    builder.add(absl::StrCat("box", i), box, 1, {0.02 * width * ((i * 7) % 5 - 2), 0, i - 4.5});
  }
  return builder.world();
}

// 25 + 16 + 9 + 4 + 1 boxes.
WorldDescription pyramid(const WorldSettings& settings) {
  WorldBuilder builder(settings);
  builder.add("floor", builder.shape(Box{{100, 100, 2}}), 1, {0, 0, -3.5}, Motion::kStatic);
  const ShapeId box = builder.shape(Box{{1, 1, 1}});
  for (int layer = 0; layer < 5; ++layer) {
    const int side = 5 - layer;
    for (int n = 0; n < side * side; ++n) {
      const double across = 1.02 * (n % side - 0.5 * (side - 1));
      const int row = n / side;
      const double along = 1.02 * (row - 0.5 * (side - 1));
      builder.add(absl::StrCat("box", layer, "_", n), box, 1, {across + 0.011, along + 0.007, layer - 2.0});
    }
  }
  return builder.world();
}

constexpr double kCardLean = 0.28;  // rad from upright

// Two cards that lean against each other, with their feet at height `foot`.
void lean_cards(WorldBuilder& builder, ShapeId card, double x, double foot, const Eigen::Vector3d& size) {
  for (const int side : {-1, 1}) {
    // The lower outer edges stand on the ground, the upper inner edges meet.
    const double sine = std::sin(kCardLean), cosine = std::cos(kCardLean);
    const double half_width = 0.5 * (size.z() * sine + size.x() * cosine);
    const double half_height = 0.5 * (size.z() * cosine + size.x() * sine);
    BodyDescription& body = builder.add(absl::StrCat("card", x, "_", foot, "_", side), card, 1,
                                        {x + side * half_width, 0, foot + half_height});
    body.pose.orientation = Eigen::AngleAxisd(-side * kCardLean, Eigen::Vector3d::UnitY());
    body.properties.friction = 1;
  }
}

// Two storeys: three pairs of cards and one flat card between them, held by friction alone.
WorldDescription card_house(const WorldSettings& settings) {
  const Eigen::Vector3d size(0.1, 1, 1.6);
  WorldBuilder builder(settings);
  builder.add("floor", builder.shape(Box{{100, 100, 2}}), 1, {0, 0, -2.6}, Motion::kStatic)
      .properties.friction = 1;
  const ShapeId card = builder.shape(Box{size});
  const double height = size.z() * std::cos(kCardLean) + size.x() * std::sin(kCardLean);
  const double apart = size.z() * std::sin(kCardLean) + size.x() * std::cos(kCardLean) + 0.05;
  lean_cards(builder, card, 0.013 - apart, -1.6, size);
  lean_cards(builder, card, 0.013 + apart, -1.6, size);
  const ShapeId ceiling = builder.shape(Box{{2 * apart + 0.8, 1, 0.1}});
  builder.add("ceiling", ceiling, 1, {0.013, 0, height - 1.55}).properties.friction = 1;
  lean_cards(builder, card, 0.013, height - 1.5, size);
  return builder.world();
}

Scene standing(const std::string& name, const std::string& about) {
  Scene scene;
  scene.name = name;
  scene.about = about;
  scene.energy = EnergyRule::kNoGain;
  scene.stands = stands_still;
  return scene;
}

Scene tower(const std::string& name, const std::string& about) {
  Scene scene = standing(name, about);
  scene.lowest = -5;
  scene.build = [](const WorldSettings& settings) { return tower_world(settings, 10, {0, 0, -5}); };
  return scene;
}

}  // namespace

std::vector<Scene> stack_scenes() {
  Scene level = tower("tower_level", "tower of 10 boxes, with a horizontal seam through its middle");
  level.seam = {0, 0, 1};
  Scene upright = tower("tower_upright", "the same tower, with a vertical seam through its middle");
  Scene small =
      tower("tower_small", "the same tower in sectors of 1.75 m, the smallest possible for its boxes");
  small.seam = {0, 0, 1};
  small.sector_size = 1.75;
  // A sector is at least as long as the diagonal of its moving bodies, so only slim boxes fit one per sector.
  Scene own = standing("tower_own", "ten slim boxes, each in its own sector");
  own.seam = {0, 0, 1};
  own.sector_size = 1.116;
  own.solver_iterations = 30;
  own.lowest = -5;
  own.build = [](const WorldSettings& settings) { return slim_tower(settings, 0.35); };
  Scene stones = standing("pyramid", "pyramid of 55 boxes");
  stones.lowest = -2.5;
  stones.build = pyramid;
  Scene cards = standing("card_house", "card house of two storeys, 7 cards");
  cards.lowest = -1.6;
  cards.build = card_house;
  return {level, upright, small, own, stones, cards};
}

}  // namespace tessera::seams
