// What joints hold hits a plate at high speed: it turns far within a step, and gains no energy.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "lpss/base/rotation.h"
#include "lpss/engine/test_world.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"

namespace tessera {
namespace {

using Eigen::Vector3d;

constexpr double kEdge = 0.7;        // m, of a box
constexpr double kMass = 10;         // kg
constexpr double kPairsApart = 400;  // m, pairs
constexpr int kTurns = 12;           // of each pair, at each speed
constexpr double kStartsAt = 30;     // m, above the plate at most
constexpr JointType kTypes[] = {JointType::kFixed, JointType::kRevolute, JointType::kBall,
                                JointType::kPrismatic};
constexpr double kSpeeds[] = {60, 150, 300, 500, 1500, 5000};  // m/s

// Pairs of boxes, each above a plate of its own that it flies at aslant, turned anyhow. Nothing else acts.
WorldDescription pairs() {
  WorldSettings settings = sectors_of(8);
  settings.gravity = UniformGravity{Vector3d::Zero()};
  settings.precision = engine_tests::test_precision;
  WorldBuilder builder(settings);
  const ShapeId box = builder.shape(Box{{kEdge, kEdge, kEdge}});
  const ShapeId plate = builder.shape(Box{{12, 12, 1}});
  Vector3d place = Vector3d::Zero();
  for (const JointType type : kTypes) {
    for (const double speed : kSpeeds) {
      for (int n = 0; n < kTurns; ++n, place.x() += kPairsApart) {
        const std::string name = std::to_string(builder.world().joints.size());
        builder.add("plate" + name, plate, 1, place - Vector3d(0, 0, 0.5), Motion::kStatic);
        const Eigen::Quaterniond turn = rotation_by({1.1 * n, 0.7 * n - 3, 0.3 * n});
        const Vector3d velocity = speed * Vector3d(std::cos(1.0 * n), std::sin(1.0 * n), -0.4).normalized();
        const double ahead = std::min(2.5 / -velocity.z(), kStartsAt / speed) + 0.003;  // s
        const Vector3d start = place - velocity * ahead;
        for (const double side : {-1.0, 1.0}) {
          const std::string body = (side < 0 ? "a" : "b") + name;
          const Vector3d middle = start + turn * Vector3d(0.8 * kEdge * side, 0, 0);
          BodyDescription& half = builder.add(body, box, kMass, middle);
          half.pose.orientation = turn;
          half.linear_velocity = velocity;
        }
        builder.tie("joint" + name, type, "a" + name, "b" + name, start, turn * Vector3d::UnitZ());
      }
    }
  }
  return builder.world();
}

double kinetic(const BodyRecord& body) {
  const Vector3d velocity(body.state.linear_velocity.data());
  const Vector3d spin(body.state.angular_velocity.data());
  return (kMass * velocity.squaredNorm() + body.properties.inertia[0] * spin.squaredNorm()) / 2;
}

TEST(FastJoints, GainNoEnergyFromAPlate) {
  const WorldDescription world = pairs();
  const auto cluster = cluster_of(world, 1);
  std::vector<double> before(world.joints.size());
  for (int tick = 0; tick <= 40; ++tick) {
    for (std::size_t n = 0; n < before.size(); ++n) {
      const BodyRecord a = *cluster->body(BodyId{3 * n + 2});
      const BodyRecord b = *cluster->body(BodyId{3 * n + 3});
      const double now = kinetic(a) + kinetic(b);
      if (tick == 0) before[n] = now;
      ASSERT_LE(now, 1.001 * before[n]) << "pair " << n << ", tick " << tick;
    }
    cluster->step();
  }
}

}  // namespace
}  // namespace tessera
