// Solids that fall on a surface of triangles, askew, in the middle of faces and over their edges.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <random>

#include "lpss/engine/test_world.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

constexpr double kHillsHalf = 36;  // m
constexpr int kSide = 15;          // stones along an axis
constexpr double kApart = 3.7;     // m
constexpr double kHeight = 3;      // m, from which they fall
constexpr double kGravity = 9.8;   // m/s^2

WorldDescription dropped(const Geometry& geometry) {
  WorldSettings settings;
  settings.precision = engine_tests::test_precision;
  settings.gravity = UniformGravity{Eigen::Vector3d(0, 0, -kGravity)};
  WorldBuilder builder(settings);
  builder.add("ground", builder.shape(hills(kHillsHalf)), 1, Eigen::Vector3d::Zero(), Motion::kStatic);
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
