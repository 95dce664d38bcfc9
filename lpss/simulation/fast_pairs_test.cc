// Two fast bodies from different sectors that fly at each other meet, wherever the borders are.
#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "lpss/engine/test_world.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"

namespace tessera {
namespace {

constexpr double kDuelSector = 16;   // m
constexpr double kBall = 0.1;        // m
constexpr double kMeetAfter = 0.31;  // s, until they meet; not at the end of a tick
constexpr int kDuelTicks = 30;

struct Duel {
  Eigen::Vector3d axis;
  double speed_a;  // m/s, along the axis
  double speed_b;  // m/s, against it
  double where;    // m, along the axis from the centre of a sector

  std::string text() const {
    const Eigen::IOFormat row(3, 0, " ", " ");
    std::ostringstream out;
    out << speed_a << " and " << speed_b << " m/s, along " << axis.transpose().format(row) << ", at " << where
        << " m";
    return out.str();
  }
};

WorldDescription world_of(const Duel& duel) {
  WorldSettings settings = sectors_of(kDuelSector);
  settings.gravity = UniformGravity{Eigen::Vector3d::Zero()};
  settings.precision = engine_tests::test_precision;
  WorldBuilder builder(settings);
  const ShapeId ball = builder.shape(Sphere{kBall});
  const Eigen::Vector3d axis = duel.axis.normalized();
  const Eigen::Vector3d beside =
      0.1 * kBall * axis.unitOrthogonal();  // so that they meet a little off centre
  const auto place = [&](double speed) -> Eigen::Vector3d {
    return axis * (duel.where - speed * kMeetAfter - (speed > 0 ? kBall : -kBall));
  };
  builder.add("a", ball, 1, place(duel.speed_a) + beside).linear_velocity = axis * duel.speed_a;
  builder.add("b", ball, 1, place(-duel.speed_b)).linear_velocity = -axis * duel.speed_b;
  return builder.world();
}

// The speed (m/s) at which they still approach each other along the axis. What is left of that of two
// inelastic balls is the share along their common tangent, sin^2 of its slope.
double duel_approach(const Duel& duel) {
  const auto cluster = cluster_of(world_of(duel), 1);
  for (int tick = 0; tick < kDuelTicks; ++tick) cluster->step();
  const auto velocity = [&](std::uint64_t id) {
    return Eigen::Vector3d(cluster->body(BodyId{id})->state.linear_velocity.data());
  };
  return (velocity(1) - velocity(2)).dot(duel.axis.normalized());
}

const Eigen::Vector3d kDuelAxes[] = {{1, 0, 0}, {0, -1, 0}, {1, 1, 0}, {-1, 1, 1}, {0.9, -0.3, 0.2}};
const std::pair<double, double> kDuelSpeeds[] = {
    {45, 45}, {60, 60}, {60, 45}, {60, 300}, {300, 300}, {300, 1000}, {1000, 60}, {1000, 900}, {1000, 1000}};

TEST(FastPairs, MeetWhereverTheBordersAre) {
  for (const Eigen::Vector3d& axis : kDuelAxes) {
    for (const auto& [speed_a, speed_b] : kDuelSpeeds) {
      for (double where = -8; where < 8; where += 1.3) {
        const Duel duel{axis, speed_a, speed_b, where};
        EXPECT_LT(duel_approach(duel), 0.05 * (speed_a + speed_b)) << duel.text();
      }
    }
  }
}

TEST(FastPairs, AreTheSameOnAnyNumberOfServers) {
  for (const auto& [speed_a, speed_b] : kDuelSpeeds) {
    for (const double where : {-7.9, 0.3, 5.3}) {
      const WorldDescription world = world_of({{1, 0.4, 0}, speed_a, speed_b, where});
      const std::vector<WorldHash> one = run(world, 1, 1, kDuelTicks);
      for (const std::uint32_t servers : {2, 5}) {
        EXPECT_EQ(first_difference(one, run(world, servers, 1, kDuelTicks)), one.size())
            << speed_a << " and " << speed_b << " m/s, " << servers << " servers";
      }
    }
  }
}

}  // namespace
}  // namespace tessera
