// Scene 3: bodies that pass a push on, from sector to sector.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>

#include "experiments/seams/scene.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera::seams {
namespace {

constexpr int kDominoes = 40;

// 20 m of dominoes; the first is pushed over.
WorldDescription dominoes(const WorldSettings& settings) {
  WorldBuilder builder(settings);
  builder.add("floor", builder.shape(Box{{100, 100, 2}}), 1, {0, 0, -1.6}, Motion::kStatic);
  const ShapeId domino = builder.shape(Box{{0.15, 0.6, 1.2}});
  for (int i = 0; i < kDominoes; ++i) {
    BodyDescription& body =
        builder.add(absl::StrCat("domino", i), domino, 1, {0.5 * (i - 0.5 * (kDominoes - 1)) + 0.017, 0, 0});
    if (i > 0) continue;
    body.angular_velocity.y() = 1.5;
    body.linear_velocity.x() = 0.6 * body.angular_velocity.y();
  }
  return builder.world();
}

bool all_have_fallen(const Course& run, const Course&) {
  return std::all_of(run.end.begin(), run.end.end(), [](const Sample& domino) {
    return (domino.orientation * Eigen::Vector3d::UnitZ()).z() < 0.7;
  });
}

constexpr int kBalls = 5;
constexpr double kRod = 4;  // m

// Five balls on massless rods, 3 mm apart, so that pairs collide one after another. The first is released at
// 30 degrees.
WorldDescription cradle(const WorldSettings& settings) {
  WorldBuilder builder(settings);
  const ShapeId ball = builder.shape(Sphere{0.5});
  for (int i = 0; i < kBalls; ++i) {
    const double x = 1.003 * (i - 2) + 0.0007;
    const std::string name = absl::StrCat("ball", i);
    const double angle = i == 0 ? M_PI / 6 : 0;
    const Eigen::Vector3d pivot(x, 0, kRod);
    BodyDescription& body =
        builder.add(name, ball, 1, pivot + kRod * Eigen::Vector3d(-std::sin(angle), 0, -std::cos(angle)));
    body.properties.restitution = 1;
    body.properties.friction = 0;
    builder.tie(absl::StrCat("rod", i), JointType::kRevolute, "", name, pivot, Eigen::Vector3d::UnitY());
  }
  return builder.world();
}

// The last ball must rise at least half as high as the first one fell.
bool last_swings_up(const Course& run, const Course&) {
  const double fall = run.start.front().position.z();
  return run.highest.back().z() > 0.5 * fall;
}

}  // namespace

std::vector<Scene> toppling_scenes() {
  Scene line;
  line.name = "dominoes";
  line.about = "a line of 40 dominoes through four sectors of 7 m";
  line.sector_size = 7;
  line.extent = 12;
  line.lowest = -0.6;
  line.energy = EnergyRule::kNoGain;
  line.build = dominoes;
  line.stands = all_have_fallen;

  Scene newton;
  newton.name = "cradle";
  newton.about = "Newton's cradle of 5 balls on rods";
  newton.extent = 6;
  newton.lowest = 0;
  newton.solver_iterations = 30;
  newton.energy = EnergyRule::kNoGain;
  newton.build = cradle;
  newton.stands = last_swings_up;
  return {line, newton};
}

}  // namespace tessera::seams
