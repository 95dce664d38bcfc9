// Scene 9: a pile of mixed bodies, poured into a bin over the corner of eight sectors.
#include <absl/strings/str_cat.h>

#include "experiments/seams/piles.h"
#include "experiments/seams/scene.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera::seams {
namespace {

constexpr double kBin = 16;   // m, inside
constexpr double kDeep = -4;  // m: its floor, so that the pile also crosses a horizontal seam

void add_bin(WorldBuilder& builder) {
  builder.add("floor", builder.shape(Box{{kBin + 8, kBin + 8, 2}}), 1, {0, 0, kDeep - 1}, Motion::kStatic);
  const ShapeId across = builder.shape(Box{{2, kBin + 4, 40}});
  const ShapeId along = builder.shape(Box{{kBin + 4, 2, 40}});
  for (const int side : {-1, 1}) {
    builder.add(absl::StrCat("wall_x", side), across, 1, {side * (kBin / 2 + 1), 0, kDeep + 20},
                Motion::kStatic);
    builder.add(absl::StrCat("wall_y", side), along, 1, {0, side * (kBin / 2 + 1), kDeep + 20},
                Motion::kStatic);
  }
}

// A pile that only falls rises at most as far as the solver pushes bodies out of overlaps.
bool lies_in_bin(const Course& run, const Course&) {
  for (const Sample& sample : run.end) {
    if (sample.position.head<2>().cwiseAbs().maxCoeff() > kBin / 2) return false;
    if (sample.position.z() < kDeep || !sample.position.allFinite()) return false;
  }
  return true;
}

}  // namespace

WorldDescription bin_world(const WorldSettings& settings, int count) {
  constexpr int kSide = 12;
  WorldBuilder builder(settings);
  add_bin(builder);
  const ShapeId shapes[] = {builder.shape(Box{{1, 1, 1}}), builder.shape(Sphere{0.5}),
                            builder.shape(Cylinder{0.5, 1}), builder.shape(Capsule{0.3, 0.6})};
  for (int i = 0; i < count; ++i) {
    const int layer = i / (kSide * kSide);
    const int column = i % kSide;
    const int row = i / kSide % kSide;
    const Eigen::Vector3d place(1.25 * (column - 0.5 * (kSide - 1)) + 0.03 * (layer % 3 - 1),
                                1.25 * (row - 0.5 * (kSide - 1)) + 0.027 * ((layer + i) % 5 - 2),
                                kDeep + 0.7 + 1.3 * layer);
    BodyDescription& body = builder.add(absl::StrCat("body", i), shapes[(i + layer) % 4], 1, place);
    // Rolling bodies come to rest as on a soft floor: contacts alone do not resist rolling.
    body.properties.angular_damping = 0.5;
  }
  return builder.world();
}

std::vector<Scene> pile_scenes() {
  Scene pile;
  pile.name = "pile";
  pile.about = "2000 mixed bodies poured into a bin";
  pile.extent = 24;
  pile.ticks = 2400;  // asleep after about 1440
  pile.lowest = kDeep;
  pile.energy = EnergyRule::kNoGain;
  pile.heavy = true;
  pile.build = [](const WorldSettings& settings) { return bin_world(settings, 2000); };
  pile.stands = lies_in_bin;
  return {pile};
}

}  // namespace tessera::seams
