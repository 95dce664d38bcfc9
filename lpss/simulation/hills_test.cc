// Solids that fall on a surface of triangles, askew, in the middle of faces and over their edges.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "lpss/bullet/test_world.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

constexpr int kSide = 15;         // stones along an axis
constexpr double kApart = 3.7;    // m
constexpr double kHeight = 3;     // m, from which they fall
constexpr double kGravity = 9.8;  // m/s^2

TriangleMesh hills() {
  constexpr std::uint32_t kCells = 36;
  constexpr double kCell = 2;  // m
  TriangleMesh mesh;
  for (std::uint32_t row = 0; row <= kCells; ++row) {
    for (std::uint32_t column = 0; column <= kCells; ++column) {
      const double x = kCell * (column - 0.5 * kCells);
      const double y = kCell * (row - 0.5 * kCells);
      mesh.vertices.emplace_back(x, y, 0.25 * (std::sin(0.4 * x) + std::sin(0.4 * y)));
    }
  }
  for (std::uint32_t row = 0; row < kCells; ++row) {
    for (std::uint32_t column = 0; column < kCells; ++column) {
      const std::uint32_t corner = row * (kCells + 1) + column;
      const std::uint32_t above = corner + kCells + 1;
      for (const std::uint32_t vertex : {corner, corner + 1, above + 1, corner, above + 1, above})
        mesh.indices.push_back(vertex);
    }
  }
  return mesh;
}

// A box whose top is smaller than its bottom.
ConvexHull stone() {
  ConvexHull hull;
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      hull.points.emplace_back(0.5 * x, 0.4 * y, -0.3);
      hull.points.emplace_back(0.3 * x, 0.25 * y, 0.3);
    }
  }
  return hull;
}

WorldDescription dropped(const Geometry& geometry) {
  WorldSettings settings;
  settings.precision = bullet::test_precision;
  settings.gravity = UniformGravity{Eigen::Vector3d(0, 0, -kGravity)};
  WorldBuilder builder(settings);
  builder.add("ground", builder.shape(hills()), 1, Eigen::Vector3d::Zero(), Motion::kStatic);
  const ShapeId shape = builder.shape(geometry);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> within(-1, 1);
  for (int n = 0; n < kSide * kSide; ++n) {
    const Eigen::Vector3d place(kApart * (n % kSide - kSide / 2) + 0.3 * within(random),
                                kApart * (n / kSide - kSide / 2) + 0.3 * within(random), kHeight);
    BodyDescription& body = builder.add(absl::StrCat("stone", n), shape, 1, place);
    body.pose.orientation =
        Eigen::Quaterniond(within(random), within(random), within(random), within(random)).normalized();
  }
  return builder.world();
}

// No body is ever faster than it has fallen, but for what opens the overlap of a hit, nor below the ground.
TEST(Hills, NothingIsThrownOrLost) {
  constexpr double kOverlap = 0.15;  // m
  const Geometry plate = Box{{1.5, 1.5, 0.05}};
  for (const Geometry& geometry : {Geometry(stone()), Geometry(Box{{1, 0.8, 0.6}}), plate}) {
    const auto simulation = Simulation::create(dropped(geometry)).value();
    for (int tick = 0; tick < 240; ++tick) {
      simulation->step();
      simulation->for_each_body([&](const BodyRecord& body) {
        const double speed = Eigen::Vector3d(body.state.linear_velocity.data()).norm();
        const double fallen = kHeight - body.state.position[2];
        EXPECT_LT(fallen, kHeight + 1) << body.id.value << ", tick " << tick;
        EXPECT_LE(speed * speed, 2 * kGravity * (fallen + kOverlap)) << body.id.value << ", tick " << tick;
      });
    }
  }
}

}  // namespace
}  // namespace tessera
