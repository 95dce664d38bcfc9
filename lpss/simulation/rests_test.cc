// What rests stays where it is: at rest, a step is a fixed point. Assemblies stand on slopes below the angle
// of friction, with masses that differ by up to a thousand between what touches and what it bears.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "lpss/engine/test_world.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"

namespace tessera {
namespace {

constexpr double kSlopeGravity = 9.81;
constexpr double kSlopeFriction = 0.8;

WorldBuilder slope_of(double share, double sector_size, std::mt19937& random) {
  WorldSettings settings = sectors_of(sector_size);
  settings.precision = engine_tests::test_precision;
  settings.sleep_after = 0;
  const double angle = share * std::atan(kSlopeFriction);
  const double towards = std::uniform_real_distribution(0.0, 2 * std::numbers::pi)(random);
  settings.gravity =
      UniformGravity{{kSlopeGravity * std::sin(angle) * std::cos(towards),
                      kSlopeGravity * std::sin(angle) * std::sin(towards), -kSlopeGravity * std::cos(angle)}};
  WorldBuilder builder(settings);
  builder.add_floor(20, 0);
  builder.world().bodies.back().properties.friction = kSlopeFriction;
  return builder;
}

BodyDescription& add_box(WorldBuilder& builder, const std::string& name, const Eigen::Vector3d& size,
                         double mass, const Eigen::Vector3d& place) {
  BodyDescription& body = builder.add(name, builder.shape(Box{{size.x(), size.y(), size.z()}}), mass, place);
  body.properties.friction = kSlopeFriction;
  return body;
}

// A low table: a top on legs, each by a fixed joint, or by a hinge that a servo holds.
void add_table(WorldBuilder& builder, JointType type, double leg, double top) {
  add_box(builder, "top", {1.2, 1, 0.1}, top, {0, 0, 0.2});
  for (int n = 0; n < 4; ++n) {
    const std::string name = "leg" + std::to_string(n);
    const Eigen::Vector3d corner((n % 2 ? 0.5 : -0.5), (n / 2 ? 0.4 : -0.4), 0);
    add_box(builder, name, {0.1, 0.1, 0.15}, leg, corner + Eigen::Vector3d(0, 0, 0.075));
    JointDescription& joint =
        builder.tie("joint" + std::to_string(n), type, "top", name, corner + Eigen::Vector3d(0, 0, 0.15));
    if (type == JointType::kRevolute) joint.drives[0] = {DriveMode::kServo, 0, 2e4 * top, 2e2 * top};
  }
}

// m, by which bodies move from one second to another, at most.
double way_between(PartitionCluster& cluster, std::size_t bodies, double sector_size, int from, int to,
                   int& tick) {
  const auto run_to = [&](int second) {
    for (; tick < 60 * second; ++tick) cluster.step();
    std::vector<Eigen::Vector3d> places;
    for (std::size_t n = 1; n < bodies; ++n) {
      const BodyRecord body = cluster.body(BodyId{n + 1}).value();
      places.push_back(Eigen::Vector3d(body.state.position.data()) +
                       sector_size *
                           Eigen::Vector3d(double(body.home.i), double(body.home.j), double(body.home.k)));
    }
    return places;
  };
  const std::vector<Eigen::Vector3d> before = run_to(from);
  const std::vector<Eigen::Vector3d> after = run_to(to);
  double most = 0;
  for (std::size_t n = 0; n < before.size(); ++n) most = std::max(most, (after[n] - before[n]).norm());
  return most;
}

// By the size of sectors, m: with 2 m, borders go through all.
class Rests : public testing::TestWithParam<double> {
 protected:
  // `creep`: m, in the last four seconds; what rounding leaves in f32.
  void expect_rest(const WorldBuilder& builder, const std::string& what, double creep = 4e-6) {
    const auto cluster = cluster_of(builder.world(), 1);
    int tick = 0;
    const std::size_t bodies = builder.world().bodies.size();
    EXPECT_LE(way_between(*cluster, bodies, GetParam(), 1, 6, tick), 1e-4) << what;
    EXPECT_LE(way_between(*cluster, bodies, GetParam(), 6, 10, tick), creep) << what;
  }
};

TEST_P(Rests, PairsByAFixedJointStayOnSlopes) {
  std::mt19937 random(1);
  for (const double ratio : {0.1, 1.0, 10.0, 1000.0}) {
    for (const double share : {0.0, 0.5, 0.95}) {
      WorldBuilder builder = slope_of(share, GetParam(), random);
      add_box(builder, "foot", {1, 0.8, 0.1}, 2, {0, 0, 0.05});
      add_box(builder, "load", {0.2, 0.2, 0.1}, 2 * ratio, {0.1, -0.1, 0.15});
      builder.tie("joint", JointType::kFixed, "foot", "load", {0.1, -0.1, 0.1});
      expect_rest(builder, "ratio " + std::to_string(ratio) + ", share " + std::to_string(share));
    }
  }
}

TEST_P(Rests, TablesStayOnSlopes) {
  std::mt19937 random(2);
  for (const JointType type : {JointType::kFixed, JointType::kRevolute}) {
    for (const double ratio : {1.0, 10.0, 1000.0}) {
      for (const double share : {0.0, 0.5, 0.9}) {
        WorldBuilder builder = slope_of(share, GetParam(), random);
        add_table(builder, type, 0.5, 0.5 * ratio);
        expect_rest(builder, std::string(type == JointType::kFixed ? "fixed" : "servos") + ", ratio " +
                                 std::to_string(ratio) + ", share " + std::to_string(share));
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Sectors, Rests, testing::Values(128.0, 2.0));

}  // namespace
}  // namespace tessera
