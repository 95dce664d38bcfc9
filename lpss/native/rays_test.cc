// Rays at bodies of every shape, however they are turned and placed: where the shapes of their parts are met.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <random>
#include <variant>
#include <vector>

#include "lpss/collision/convex_hull.h"
#include "lpss/collision/ray.h"
#include "lpss/engine/test_world.h"

namespace tessera::native {
namespace {

using collision::Ray;
using collision::RayContact;
using engine_tests::static_body;
using engine_tests::test_engine;
using engine_tests::test_settings;
using engine_tests::TestWorld;

using Planes = std::vector<collision::HalfSpace<double>>;

// Of the parts that are hulls.
std::vector<Planes> planes_by_part(const Shape& shape) {
  std::vector<Planes> planes(shape.parts.size());
  for (std::size_t n = 0; n < planes.size(); ++n) {
    if (const auto* hull = std::get_if<ConvexHull>(&shape.parts[n].geometry))
      planes[n] = planes_of(collision::convex_hull(hull->points));
  }
  return planes;
}

struct MeetGeometry {
  const Ray& ray;
  const Planes& planes;

  std::optional<RayContact> operator()(const tessera::Box& box) const { return meet_box(ray, box.size / 2); }
  std::optional<RayContact> operator()(const Sphere& ball) const { return meet_ball(ray, ball.radius); }
  std::optional<RayContact> operator()(const Capsule& capsule) const {
    return meet_capsule(ray, capsule.radius, capsule.length / 2);
  }
  std::optional<RayContact> operator()(const Cylinder& cylinder) const {
    return meet_cylinder(ray, cylinder.radius, cylinder.length / 2);
  }
  std::optional<RayContact> operator()(const Ellipsoid& ellipsoid) const {
    return meet_ellipsoid(ray, ellipsoid.radii);
  }
  std::optional<RayContact> operator()(const ConvexHull&) const { return meet_planes(ray, planes); }
  template <typename Other>
  std::optional<RayContact> operator()(const Other&) const {
    return std::nullopt;
  }
};

std::optional<RayContact> meet_shape(const Shape& shape, const std::vector<Planes>& planes, const Pose& body,
                                     const Ray& ray) {
  std::optional<RayContact> nearest;
  for (std::size_t n = 0; n < planes.size(); ++n) {
    const ShapePart& part = shape.parts[n];
    const Pose pose = body * part.pose;
    const Eigen::Matrix3d turn = pose.orientation.toRotationMatrix();
    const Ray in_part{turn.transpose() * (ray.from - pose.position), turn.transpose() * ray.way};
    std::optional<RayContact> contact = std::visit(MeetGeometry{in_part, planes[n]}, part.geometry);
    if (!contact || (nearest && nearest->t <= contact->t)) continue;
    contact->normal = turn * contact->normal;
    nearest = contact;
  }
  return nearest;
}

Shape many_sided() {
  ConvexHull hull;
  for (int n = 0; n < 300; ++n) {
    const double angle = n * std::numbers::pi / 150;
    for (const double z : {-0.4, 0.4})
      hull.points.push_back({0.5 * std::cos(angle), 0.5 * std::sin(angle), z});
  }
  return {{{hull, {}}}};
}

void expect_met_exactly(ShapeId id, const Shape& shape, Motion motion) {
  const auto engine = test_engine(test_settings());
  engine->add_shape(id + 100, shape);
  TestWorld world(*engine);
  BodyRecord record = static_body(5, id + 100, {3, -2, 1});
  record.properties.motion = motion;
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, -2, 3).normalized()).toRotationMatrix();
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(record.state.rotation.data()) = turn;
  world.add(record, motion == Motion::kStatic ? Role::kStatic : Role::kHome);
  const Pose body{{3, -2, 1}, Eigen::Quaterniond(turn)};

  // Where bodies that move and parts of compounds are, the engine's numbers say.
  const bool is_rounded = engine_tests::test_precision == Precision::kFloat32 && motion != Motion::kStatic;
  const double exact = is_rounded ? 1e-6 : engine_tests::test_precision == Precision::kFloat32 ? 1e-8 : 1e-12;
  std::mt19937_64 random(17);
  std::normal_distribution<double> normal;
  const auto draw = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  const std::vector<Planes> planes = planes_by_part(shape);
  int hits = 0;
  int misses = 0;
  for (int n = 0; n < 2000; ++n) {
    const Eigen::Vector3d from = body.position + draw().normalized() * (2 + 5 * std::abs(normal(random)));
    const Eigen::Vector3d to = 2 * (body.position + 0.4 * draw()) - from;
    const std::optional<RayContact> right = meet_shape(shape, planes, body, {from, to - from});
    const std::optional<RayHit> got = world.world().raycast(from, to, {1});
    if (right.has_value() != got.has_value()) {
      ++misses;
      continue;
    }
    if (!right) continue;
    ++hits;
    const double slope = std::abs(right->normal.dot(to - from));
    // At an edge, rounding decides between two normals.
    const bool is_same_side = (right->normal - got->normal).norm() < 0.01;
    misses += !is_same_side;
    if (!is_same_side) continue;
    EXPECT_NEAR((got->fraction - right->t) * slope, 0, 10 * exact) << id;
    EXPECT_LT((right->normal - got->normal).norm() * std::sqrt(slope / (to - from).norm()), 1e3 * exact)
        << id;
  }
  EXPECT_GT(hits, 200) << id;
  EXPECT_LE(misses, is_rounded ? 2 : 0) << id;
}

TEST(RaysTest, MeetEveryShapeWhereItIs) {
  for (const Motion motion : {Motion::kStatic, Motion::kDynamic}) {
    for (ShapeId id = 0; id < engine_tests::kDynamicShapes; ++id)
      expect_met_exactly(id, engine_tests::test_shape(id), motion);
    expect_met_exactly(90, many_sided(), motion);
  }
}

// The first of several; from inside of one, the next one.
TEST(RaysTest, PassOutOfWhatTheyBeginIn) {
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  world.add(static_body(1, engine_tests::kBoxShape, {0, 0, 0}));
  world.add(static_body(2, engine_tests::kSphereShape, {3, 0, 0}));
  const auto hit = world.world().raycast({0, 0, 0}, {10, 0, 0}, {1});
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->body.value, 2u);
  EXPECT_NEAR(hit->fraction, 0.25, 1e-12);
}

TEST(RaysTest, SurfacesAreMetFromBothSides) {
  for (const ShapeId id :
       {engine_tests::kPlaneShape, engine_tests::kMeshShape, engine_tests::kHeightFieldShape}) {
    const auto engine = test_engine(test_settings());
    TestWorld world(*engine);
    const double height = id == engine_tests::kHeightFieldShape ? 0.5 : 0;
    world.add(static_body(1, id, {0, 0, -height}));
    for (const double side : {-1., 1.}) {
      const auto hit = world.world().raycast({1.3, 0.4, 3 * side}, {2.3, 0.7, -1 * side}, {1});
      ASSERT_TRUE(hit) << id;
      EXPECT_NEAR(hit->fraction, 0.75, 1e-7) << id;
      EXPECT_NEAR((hit->normal - Eigen::Vector3d(0, 0, side)).norm(), 0, 1e-7) << id;
    }
    EXPECT_FALSE(world.world().raycast({1.3, 0.4, 3}, {2.3, 0.7, 0.1}, {1})) << id;
  }
}

TEST(RaysTest, WhatIsNoRayMeetsNothing) {
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  world.add(static_body(1, engine_tests::kBoxShape, {0, 0, 0}));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(world.world().raycast({0, 0, 2}, {0, 0, 2}, {1}));
  EXPECT_FALSE(world.world().raycast({0, 0, nan}, {0, 0, -2}, {1}));
  EXPECT_FALSE(world.world().raycast({0, 0, 2}, {nan, 0, -2}, {1}));
  EXPECT_FALSE(world.world().raycast({0, 0, 2}, {0, 0, -std::numeric_limits<double>::infinity()}, {1}));
}

}  // namespace
}  // namespace tessera::native
