#include "experiments/performance/scenes.h"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "lpss/base/portable_math.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera {
namespace {

constexpr double kHalfFloor = 120;  // m

// Numbers in [0, 1), the same on every machine.
class Scatter {
 public:
  double next() {
    state_ = state_ * 6364136223846793005U + 1442695040888963407U;
    return static_cast<double>(state_ >> 40) / static_cast<double>(1 << 24);
  }

 private:
  std::uint64_t state_ = 1;
};

}  // namespace

WorldDescription dropped_boxes(const WorldSettings& settings, int count) {
  WorldBuilder builder(settings);
  builder.add_floor(kHalfFloor, 0);
  const ShapeId box = builder.shape(Box{{1, 1, 1}});
  const int side = static_cast<int>(std::ceil(std::sqrt(count / 4.0)));
  Scatter scatter;
  for (int n = 0; n < count; ++n) {
    const int layer = n / (side * side);
    const int row = n % (side * side) / side;
    const int column = n % side;
    const double x = (column - side / 2.0) * 1.1 + 0.05 * scatter.next();
    const double y = (row - side / 2.0) * 1.1 + 0.05 * scatter.next();
    builder.add(absl::StrCat("box", n), box, 1, {x, y, 0.6 + 1.1 * layer});
  }
  return builder.world();
}

WorldDescription towers_of_ten(const WorldSettings& settings, int count) {
  constexpr int kHeight = 10;
  constexpr double kApart = 3;  // m
  WorldBuilder builder(settings);
  builder.add_floor(kHalfFloor, 0);
  const ShapeId box = builder.shape(Box{{1, 1, 1}});
  const int side = static_cast<int>(std::ceil(std::sqrt(count)));
  for (int n = 0; n < count; ++n) {
    const int column = n % side;
    const int row = n / side;
    const double x = (column - side / 2.0) * kApart;
    const double y = (row - side / 2.0) * kApart;
    for (int level = 0; level < kHeight; ++level) {
      builder.add(absl::StrCat("tower", n, "_", level), box, 1,
                  {x + 0.02 * (level % 3), y + 0.013 * (level % 2), 0.5 + level});
    }
  }
  return builder.world();
}

WorldDescription mixed_bodies(const WorldSettings& settings, int count) {
  constexpr int kKinds = 7;       // of which three are capsules on joints
  constexpr double kApart = 1.6;  // m
  constexpr double kCapsule = 1;  // m, with its ends
  WorldBuilder builder(settings);
  builder.add("ground", builder.shape(hills(kHalfFloor)), 1, Eigen::Vector3d::Zero(), Motion::kStatic);
  const ShapeId hull = builder.shape(stone());
  const ShapeId capsule = builder.shape(Capsule{0.25, kCapsule - 0.5});
  const ShapeId box = builder.shape(Box{{0.8, 0.7, 0.6}});
  const ShapeId ball = builder.shape(Sphere{0.4});
  const int groups = count / kKinds;
  const int side = static_cast<int>(std::ceil(std::sqrt(groups / 4.0)));
  Scatter scatter;
  for (int n = 0; n < groups; ++n) {
    const int layer = n / (side * side);
    const int row = n % (side * side) / side;
    const Eigen::Vector3d corner((n % side - side / 2.0) * 2 * kApart, (row - side / 2.0) * 2 * kApart,
                                 2.2 + 3.2 * layer);
    const auto place = [&](double x, double y, double z) -> Eigen::Vector3d {
      return corner +
             Eigen::Vector3d(x * kApart + 0.2 * scatter.next(), y * kApart + 0.2 * scatter.next(), z);
    };
    builder.add(absl::StrCat("hull", n), hull, 1, place(0, 0, 0));
    builder.add(absl::StrCat("box", n), box, 1, place(1, 0, 0));
    builder.add(absl::StrCat("ball", n), ball, 1, place(0, 1, 0));
    builder.add(absl::StrCat("capsule", n), capsule, 1, place(1, 1, 0));
    const Eigen::Vector3d top = place(0.5, 0.5, 0);
    for (int link = 0; link < 3; ++link) {
      const std::string name = absl::StrCat("link", n, "_", link);
      const Eigen::Vector3d at = top - Eigen::Vector3d::UnitZ() * (kCapsule * (link - 1));
      builder.add(name, capsule, 1, at);
      if (link == 0) continue;
      builder.tie(absl::StrCat("joint", n, "_", link), JointType::kBall,
                  absl::StrCat("link", n, "_", link - 1), name, at + Eigen::Vector3d(0, 0, kCapsule / 2));
    }
  }
  return builder.world();
}

namespace {

void add_bottom(Bottom bottom, WorldBuilder& builder) {
  constexpr double kHalfMesh = 30;  // m
  constexpr int kCells = 224;       // along an edge
  if (bottom == Bottom::kFloor) return builder.add_floor(kHalfFloor, 0);
  const TriangleMesh mesh =
      bottom == Bottom::kHills ? hills(kHalfFloor) : hills(kHalfMesh, 2 * kHalfMesh / kCells);
  builder.add("ground", builder.shape(mesh), 1, Eigen::Vector3d::Zero(), Motion::kStatic);
}

// Four around a square, from so far below zero up.
void add_walls(double half, double below, WorldBuilder& builder) {
  constexpr double kThick = 2;        // m
  constexpr double kWallHeight = 30;  // m
  for (int wall = 0; wall < 4; ++wall) {
    const bool is_along_x = wall % 2 == 0;
    const double sign = wall < 2 ? 1 : -1;
    const double length = 2 * (half + kThick);
    const ShapeId shape =
        builder.shape(is_along_x ? Box{{kThick, length, kWallHeight}} : Box{{length, kThick, kWallHeight}});
    const double at = sign * (half + kThick / 2);
    builder.add(absl::StrCat("wall", wall), shape, 1,
                {is_along_x ? at : 0, is_along_x ? 0 : at, kWallHeight / 2 - below}, Motion::kStatic);
  }
}

}  // namespace

WorldDescription poured_bodies(const WorldSettings& settings, Poured kind, int count, Bottom bottom) {
  constexpr double kApart = 1.3;  // m
  WorldBuilder builder(settings);
  add_bottom(bottom, builder);
  const ShapeId ball = builder.shape(Sphere{0.5});
  const ShapeId capsule = builder.shape(Capsule{0.3, 0.6});
  const ShapeId box = builder.shape(Box{{0.9, 0.8, 0.7}});
  const ShapeId cylinder = builder.shape(Cylinder{0.4, 0.9});
  const ShapeId hull = builder.shape(stone());
  const std::vector<ShapeId> shapes = [&]() -> std::vector<ShapeId> {
    switch (kind) {
      case Poured::kBalls:
        return {ball};
      case Poured::kCapsules:
        return {capsule};
      case Poured::kBoxes:
        return {box};
      case Poured::kCylinders:
        return {cylinder};
      case Poured::kAll:
        return {ball, capsule, box, cylinder, hull};
    }
    return {};
  }();
  const int side = static_cast<int>(std::ceil(std::sqrt(count / 16.0)));
  const double below = bottom == Bottom::kFloor ? 0 : 1;  // m
  add_walls(side * kApart / 2 + 0.5, below, builder);
  Scatter scatter;
  for (int n = 0; n < count; ++n) {
    const int layer = n / (side * side);
    const int row = n % (side * side) / side;
    const int column = n % side;
    const Eigen::Vector3d place((column - (side - 1) / 2.0) * kApart + 0.1 * scatter.next(),
                                (row - (side - 1) / 2.0) * kApart + 0.1 * scatter.next(),
                                1 + below / 2 + kApart * layer);
    const Eigen::Vector4d turn(scatter.next() - 0.5, scatter.next() - 0.5, scatter.next() - 0.5, 0.6);
    builder.add(absl::StrCat("body", n), shapes[static_cast<std::size_t>(n) % shapes.size()], 1, place)
        .pose.orientation = Eigen::Quaterniond(turn.normalized());
  }
  return builder.world();
}

}  // namespace tessera
