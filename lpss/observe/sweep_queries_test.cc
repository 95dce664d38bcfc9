// Probes that go along a line stop where they touch bodies of any shape, in any sectors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "lpss/observe/queries.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"

namespace tessera {
namespace {

constexpr std::uint32_t kAny = 0xffffffff;
const Eigen::Vector3d kDown = -Eigen::Vector3d::UnitZ();

// m: numbers of a float near the border of a sector, and of meshes.
constexpr double kExact = 1e-4;

struct Wanted {
  std::string body;
  double distance = 0;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
};

// The same world somewhere else, on some servers, and asked there.
class Sweeps {
 public:
  Sweeps(const WorldBuilder& builder, const Eigen::Vector3d& shift, std::uint32_t partitions)
      : world_(builder.world()), shift_(shift) {
    for (BodyDescription& body : world_.bodies) body.pose.position.local += shift;
    cluster_ = cluster_of(world_, partitions);
  }

  std::optional<RayAnswer> sweep(const Geometry& probe, const Pose& pose, const Eigen::Vector3d& direction,
                                 double length, std::span<const BodyId> except = {}) {
    std::optional<RayAnswer> first;
    const WorldPose from{*canonical({}, pose.position + shift_, world_.settings.sector_size),
                         pose.orientation};
    for (Rank rank = 0; rank < cluster_->size(); ++rank) {
      const auto hit =
          tessera::sweep(cluster_->partition(rank), probe, from, direction, length, kAny, except);
      if (hit && (!first || std::pair(hit->distance, hit->body) < std::pair(first->distance, first->body)))
        first = hit;
    }
    return first;
  }

  void expect(const Geometry& probe, const Pose& pose, const Eigen::Vector3d& direction, double length,
              const Wanted& wanted) {
    const auto hit = sweep(probe, pose, direction, length);
    ASSERT_TRUE(hit) << wanted.body << " at " << shift_.transpose();
    EXPECT_EQ(world_.bodies[hit->body.value - 1].name, wanted.body) << shift_.transpose();
    EXPECT_NEAR(hit->distance, wanted.distance, kExact) << wanted.body << " at " << shift_.transpose();
    EXPECT_NEAR((hit->normal - wanted.normal).norm(), 0, 1e-3)
        << wanted.body << " at " << shift_.transpose() << ": " << hit->normal.transpose();
  }

 private:
  WorldDescription world_;
  Eigen::Vector3d shift_;
  std::unique_ptr<PartitionCluster> cluster_;
};

const std::vector<Eigen::Vector3d> kShifts{{0, 0, 0},    {4, 4, 4},     {3.5, 0, 0.25}, {0.3, 3.9, -1.7},
                                           {-4, 2, 4.2}, {2, 3.999, 1}, {800, -400, 4}};

void add_ball(WorldBuilder& builder, const std::string& name, double radius, const Eigen::Vector3d& at) {
  builder.add(name, builder.shape(Sphere{radius}), 1, at).properties.gravity = false;
}

TEST(SweepQuery, FindsTheFirstBodyWhereverBordersAre) {
  WorldBuilder builder(sectors_of(8));
  add_ball(builder, "far", 0.5, {20, 0, 0});
  add_ball(builder, "near", 0.5, {13, 0.3, 0});
  builder.add("slab", builder.shape(Box{{1, 4, 4}}), 1, {30, 0, 0}, Motion::kStatic);
  for (const Eigen::Vector3d& shift : kShifts) {
    for (const std::uint32_t partitions : {1u, 3u}) {
      Sweeps sweeps(builder, shift, partitions);
      const Eigen::Vector3d east = Eigen::Vector3d::UnitX();
      sweeps.expect(Sphere{0.25}, {}, east, 50,
                    {"near", 13 - std::sqrt(0.75 * 0.75 - 0.09),
                     Eigen::Vector3d(-std::sqrt(0.75 * 0.75 - 0.09), -0.3, 0) / 0.75});
      sweeps.expect(Box{{1, 1, 1}}, {{0, -0.8, 0}, Eigen::Quaterniond::Identity()}, east, 50,
                    {"far", 20 - 0.5 - std::sqrt(0.25 - 0.09), Eigen::Vector3d(-0.4, -0.3, 0) / 0.5});
      sweeps.expect(Capsule{0.5, 2}, {{0, 0, 2.5}, Eigen::Quaterniond::Identity()}, east, 50,
                    {"slab", 29, -east});
      EXPECT_FALSE(sweeps.sweep(Capsule{0.5, 2}, {{0, 0, 2.5}, Eigen::Quaterniond::Identity()}, east, 28.9));
      const std::vector<BodyId> near{BodyId{2}};
      EXPECT_EQ(sweeps.sweep(Sphere{0.25}, {}, east, 50, near)->body, BodyId{1});
    }
  }
}

TEST(SweepQuery, TouchesEveryKindOfShape) {
  WorldBuilder builder(sectors_of(8));
  const auto add = [&](const std::string& name, const Geometry& shape, double x,
                       const Eigen::Quaterniond& turn) {
    BodyDescription& body = builder.add(name, builder.shape(shape), 1, {x, 0, 0}, Motion::kStatic);
    body.pose.orientation = turn;
  };
  const Eigen::Quaterniond upright = Eigen::Quaterniond::Identity();
  const Eigen::Quaterniond lying(Eigen::AngleAxisd(std::acos(0), Eigen::Vector3d::UnitX()));
  add("ball", Sphere{1}, 0, upright);
  add("box", Box{{2, 2, 3}}, 5, lying);
  add("capsule", Capsule{0.5, 1}, 10, upright);
  add("cylinder", Cylinder{0.75, 3}, 15, lying);
  add("ellipsoid", Ellipsoid{{1, 1, 1.25}}, 20, upright);
  add("hull", stone(), 25, upright);
  add("mesh", hills(1.5, 0.5), 30, upright);
  HeightField field{5, 5, {0.5, 0.5}, std::vector<double>(25, 0.5)};
  add("field", field, 35, upright);
  const auto height_of_stone = [] {
    double most = 0;
    for (const Eigen::Vector3d& point : stone().points) most = std::max(most, point.z());
    return most;
  }();
  for (const Eigen::Vector3d& shift : kShifts) {
    Sweeps sweeps(builder, shift, 2);
    const auto drop = [&](const std::string& body, double x, double top) {
      const Pose from{{x, 0, 9}, Eigen::Quaterniond::Identity()};
      sweeps.expect(Sphere{0.25}, from, kDown, 20, {body, 9 - 0.25 - top});
      sweeps.expect(Box{{0.2, 0.2, 0.4}}, from, kDown, 20, {body, 9 - 0.2 - top});
    };
    drop("ball", 0, 1);
    drop("box", 5, 1);
    drop("capsule", 10, 1);
    drop("cylinder", 15, 0.75);
    drop("ellipsoid", 20, 1.25);
    drop("hull", 25, height_of_stone);
    drop("field", 35, 0.5);
    const auto on_hill = sweeps.sweep(Sphere{0.25}, {{30, 0, 9}, Eigen::Quaterniond::Identity()}, kDown, 20);
    ASSERT_TRUE(on_hill);
    // It slopes by 0.1 along x and y there.
    EXPECT_NEAR(on_hill->distance, 9 - 0.25 * std::sqrt(1.02), 1e-3);
    EXPECT_NEAR((on_hill->normal - Eigen::Vector3d(-0.1, -0.1, 1).normalized()).norm(), 0, 0.01);
    const auto below = sweeps.sweep(Sphere{0.25}, {{35, 0, -9}, Eigen::Quaterniond::Identity()}, -kDown, 20);
    ASSERT_TRUE(below);
    EXPECT_NEAR(below->distance, 9 + 0.5 - 0.25, kExact);
    EXPECT_NEAR(below->normal.z(), -1, 1e-6);
  }
}

// A ball over even ground, down a slope of 3 to 4: its centre stops at its radius, whatever triangle it is
// over, and with the normal of the ground.
TEST(SweepQuery, OverGroundItStopsAtItsRadiusOverAllTrianglesAndBorders) {
  WorldBuilder builder(sectors_of(8));
  TriangleMesh even = hills(40, 1.5);
  for (Eigen::Vector3d& vertex : even.vertices) vertex.z() = 0.25 * vertex.x();
  builder.add("ground", builder.shape(even), 1, Eigen::Vector3d::Zero(), Motion::kStatic);
  const Eigen::Vector3d up = Eigen::Vector3d(-0.25, 0, 1).normalized();
  for (const Eigen::Vector3d& shift : kShifts) {
    Sweeps sweeps(builder, shift, 2);
    const Eigen::Vector3d direction = Eigen::Vector3d(4, 0, -3) / 5;
    for (int n = 0; n < 40; ++n) {
      const Eigen::Vector3d from(0.37 * n - 12, 0.61 * n - 12, 6);
      const double height = (from.z() - 0.25 * from.x()) * up.z();
      sweeps.expect(Sphere{0.5}, {from, Eigen::Quaterniond::Identity()}, direction, 60,
                    {"ground", (height - 0.5) / -direction.dot(up), up});
    }
  }
}

TEST(SweepQuery, StopsAtAPlaneAndAtOnceWhereItOverlaps) {
  WorldBuilder builder(sectors_of(8));
  builder.add("ground", builder.shape(Plane{}), 1, Eigen::Vector3d::Zero(), Motion::kStatic);
  add_ball(builder, "ball", 0.5, {20, 0, 5});
  const Pose tilted{{3, 1, 7},
                    Eigen::Quaterniond(Eigen::AngleAxisd(std::acos(-1) / 4, Eigen::Vector3d::UnitX()))};
  for (const Eigen::Vector3d& shift : kShifts) {
    Sweeps sweeps(builder, shift, 2);
    sweeps.expect(Box{{1, 1, 1}}, tilted, kDown, 20, {"ground", 7 - std::sqrt(0.5)});
    const Pose inside{{19.8, 0, 5}, Eigen::Quaterniond::Identity()};
    const Eigen::Vector3d east = Eigen::Vector3d::UnitX();
    for (const Eigen::Vector3d& direction : {east, Eigen::Vector3d(-east)})
      sweeps.expect(Sphere{0.5}, inside, direction, 20, {"ball", 0, -east});
    // What stands on the ground goes along it.
    sweeps.expect(Sphere{0.5}, {{0, 0, 0.5}, Eigen::Quaterniond::Identity()},
                  Eigen::Vector3d(20, 0, 4.5).normalized(), 30,
                  {"ball", std::sqrt(400 + 4.5 * 4.5) - 1, Eigen::Vector3d(-20, 0, -4.5).normalized()});
    EXPECT_FALSE(sweeps.sweep(Sphere{0.5}, {{0, 0, 0.5}, Eigen::Quaterniond::Identity()}, east, 60));
  }
}

// Bullet's own cast is less exact.
TEST(SweepQuery, UnderThePolicyCloneBulletAnswers) {
  WorldBuilder builder(sectors_of(8, SeamPolicy::kClone));
  add_ball(builder, "ball", 0.5, {13, 0.3, 0});
  builder.add("ground", builder.shape(Plane{}), 1, {0, 0, -3}, Motion::kStatic);
  auto cluster = cluster_of(builder.world(), 1);
  const auto go = [&](const WorldPosition& from, const Eigen::Vector3d& direction) {
    return sweep(cluster->partition(0), Sphere{0.25}, {from}, direction, 50, kAny);
  };
  const auto hit = go({}, Eigen::Vector3d::UnitX());
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->body, BodyId{1});
  EXPECT_NEAR(hit->distance, 13 - std::sqrt(0.75 * 0.75 - 0.09), 0.05);
  EXPECT_LT(hit->normal.x(), -0.8);
  const auto below = go({}, kDown);
  ASSERT_TRUE(below);
  EXPECT_EQ(below->body, BodyId{2});
  EXPECT_NEAR(below->distance, 2.75, 0.05);
  const auto inside = go({{2, 0, 0}, {-3.2, 0.3, 0}}, Eigen::Vector3d::UnitX());
  ASSERT_TRUE(inside);
  EXPECT_EQ(inside->distance, 0);
  EXPECT_LT(inside->normal.x(), -0.9);
}

}  // namespace
}  // namespace tessera
