// What the solver pushes far in a tick is swept from where it was before, whichever server solves it.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <vector>

#include "lpss/engine/test_world.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"

namespace tessera {
namespace {

constexpr double kCrowdSector = 8;  // m
constexpr double kCrowdEdge = 0.5;  // m, of its boxes
constexpr int kCrowdSide = 3;       // boxes along an axis
constexpr int kCrowdTicks = 20;

// Boxes with a `gap` (m) between them where eight sectors meet, and a kinematic ball that flies into them,
// askew to all axes.
WorldDescription hammered_crowd(double gap, double speed, double radius) {
  WorldSettings settings = sectors_of(kCrowdSector);
  settings.gravity = UniformGravity{Eigen::Vector3d::Zero()};
  settings.precision = engine_tests::test_precision;
  WorldBuilder builder(settings);
  const ShapeId box = builder.shape(Box{{kCrowdEdge, kCrowdEdge, kCrowdEdge}});
  const Eigen::Vector3d corner = Eigen::Vector3d::Constant(kCrowdSector / 2);
  for (int n = 0; n < kCrowdSide * kCrowdSide * kCrowdSide; ++n) {
    const Eigen::Vector3i cell(n % kCrowdSide, n / kCrowdSide % kCrowdSide, n / (kCrowdSide * kCrowdSide));
    const Eigen::Vector3d from_middle =
        cell.cast<double>() - Eigen::Vector3d::Constant(0.5 * (kCrowdSide - 1));
    builder.add(absl::StrCat("box", n), box, 1, corner + (kCrowdEdge + gap) * from_middle);
  }
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 0.9, 0.8).normalized();
  const ShapeId ball = builder.shape(Sphere{radius});
  builder.add("hammer", ball, 1, corner - 3 * axis, Motion::kKinematic).linear_velocity = speed * axis;
  return builder.world();
}

// The hash after each tick, of islands that are shipped or solved in step.
std::vector<WorldHash> run_crowd(const WorldDescription& world, std::uint32_t servers, bool in_step) {
  const auto cluster = cluster_of(world, servers);
  for (Rank rank = 0; in_step && rank < servers; ++rank) cluster->partition(rank).in_step_from = 0;
  std::vector<WorldHash> hashes;
  for (int tick = 0; tick < kCrowdTicks; ++tick) {
    cluster->step();
    hashes.push_back(cluster->hash());
  }
  return hashes;
}

TEST(PushedFar, ACrowdFliesApartAlikeOnAnyNumberOfServers) {
  for (const double speed : {20, 60, 100}) {
    for (const double radius : {0.25, 1.0}) {
      for (const double gap : {0.0, 0.05, 0.2}) {
        const WorldDescription world = hammered_crowd(gap, speed, radius);
        const std::vector<WorldHash> one = run_crowd(world, 1, false);
        for (const std::uint32_t servers : {2, 3, 8}) {
          for (const bool in_step : {false, true}) {
            EXPECT_EQ(first_difference(one, run_crowd(world, servers, in_step)), one.size())
                << "at " << speed << " m/s, radius " << radius << " m, gap " << gap << " m, " << servers
                << " servers" << (in_step ? " in step" : "");
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace tessera
