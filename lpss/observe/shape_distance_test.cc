// How near shapes come to each other: right values, either way round.
#include "lpss/observe/shape_distance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace tessera {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr double kReach = 100;

Shape of(Geometry geometry, const Pose& pose = {}) { return Shape{{ShapePart{std::move(geometry), pose}}}; }

Eigen::Quaterniond turned(double angle, const Vector3d& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis.normalized()));
}

Pose at(double x, double y, double z) { return {{x, y, z}, Eigen::Quaterniond::Identity()}; }

// Likewise with the two exchanged.
ShapeDistance measured(const Shape& a, const Pose& at_a, const Shape& b, const Pose& at_b) {
  EXPECT_TRUE(check_distance(a, b).ok());
  const auto found = distance_of({a, at_a}, {b, at_b}, kReach);
  const auto reverse = distance_of({b, at_b}, {a, at_a}, kReach);
  EXPECT_TRUE(found && reverse);
  if (!found || !reverse) return {};
  EXPECT_NEAR(found->gap, reverse->gap, 1e-9);
  EXPECT_NEAR((found->normal + reverse->normal).norm(), 0, 1e-6);
  if (found->gap > 0) {
    EXPECT_NEAR((found->on_a - found->on_b - found->normal * found->gap).norm(), 0, 1e-6);
  }
  return *found;
}

void expect_equal(const Vector3d& found, const Vector3d& wanted, double error = 1e-7) {
  EXPECT_LT((found - wanted).norm(), error) << found.transpose() << " is not " << wanted.transpose();
}

TEST(ShapeDistance, OfBallsAndCapsules) {
  const ShapeDistance balls = measured(of(Sphere{1}), at(3, 4, 0), of(Sphere{0.5}), {});
  EXPECT_NEAR(balls.gap, 3.5, 1e-9);
  expect_equal(balls.normal, {0.6, 0.8, 0});
  expect_equal(balls.on_b, {0.3, 0.4, 0});
  const ShapeDistance crossed =
      measured(of(Capsule{0.2, 2}), {{0, 0, 3}, turned(std::numbers::pi / 2, Vector3d::UnitX())},
               of(Capsule{0.3, 2}), {{0, 0, 0}, turned(std::numbers::pi / 2, Vector3d::UnitY())});
  EXPECT_NEAR(crossed.gap, 2.5, 1e-9);
  expect_equal(crossed.on_a, {0, 0, 2.8});
}

TEST(ShapeDistance, OfBoxesByFacesEdgesAndCorners) {
  const Shape box = of(Box{{2, 2, 2}});
  EXPECT_NEAR(measured(box, at(0.3, 0.2, 5), box, {}).gap, 3, 1e-9);
  EXPECT_NEAR(measured(box, at(5, 6, 0), box, {}).gap, 5, 1e-9) << "edges: 3 and 4 m apart";
  EXPECT_NEAR(measured(box, at(4, 4, 4), box, {}).gap, std::sqrt(12), 1e-9) << "corners";
  const Pose on_edge{{0, 0, 3}, turned(std::numbers::pi / 4, Vector3d::UnitX())};
  const ShapeDistance edge = measured(box, on_edge, box, {});
  EXPECT_NEAR(edge.gap, 2 - std::sqrt(2), 1e-9);
  expect_equal(edge.normal, {0, 0, 1});
}

TEST(ShapeDistance, OfRoundShapesAndHulls) {
  EXPECT_NEAR(measured(of(Cylinder{0.5, 2}), at(0, 0, 4), of(Cylinder{0.5, 2}), {}).gap, 2, 1e-9);
  EXPECT_NEAR(measured(of(Ellipsoid{{1, 2, 3}}), at(0, 10, 0), of(Sphere{1}), {}).gap, 7, 1e-6);
  const Shape stone = of(ConvexHull{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}});
  EXPECT_NEAR(measured(stone, at(0, 0, 4), stone, {}).gap, 2, 1e-9);
}

TEST(ShapeDistance, OfCompoundsByTheirNearestParts) {
  Shape dumbbell = of(Sphere{0.5}, {{-2, 0, 0}, Eigen::Quaterniond::Identity()});
  dumbbell.parts.push_back(ShapePart{Sphere{0.25}, {{2, 0, 0}, Eigen::Quaterniond::Identity()}});
  const ShapeDistance found = measured(dumbbell, at(0, 5, 0), of(Box{{1, 1, 1}}), at(2, 0, 0));
  EXPECT_NEAR(found.gap, 4.25, 1e-9);
  expect_equal(found.on_a, {2, 4.75, 0});
}

TEST(ShapeDistance, OfPlanesAndSurfaces) {
  const Shape box = of(Box{{2, 2, 2}});
  const Pose tilted{{0, 0, 5}, turned(std::numbers::pi / 4, Vector3d::UnitX())};
  EXPECT_NEAR(measured(box, tilted, of(Plane{}), {}).gap, 5 - std::sqrt(2), 1e-9);
  const Shape mesh = of(TriangleMesh{{{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}}, {0, 1, 2, 0, 2, 3}});
  EXPECT_NEAR(measured(box, tilted, mesh, at(0, 0, 1)).gap, 4 - std::sqrt(2), 1e-9);
  EXPECT_NEAR(measured(of(Sphere{1}), at(12, 0, 4), mesh, {}).gap, 4, 1e-9) << "beyond its edge: 3 and 4";
  HeightField field{3, 3, {4, 4}, {0, 0, 0, 0, 2, 0, 0, 0, 0}};
  EXPECT_NEAR(measured(of(Sphere{1}), at(0, 0, 6), of(field), {}).gap, 3, 1e-9) << "over the peak";
}

TEST(ShapeDistance, IsLessThanNothingWhereTheyOverlap) {
  const Shape box = of(Box{{2, 2, 2}});
  const ShapeDistance found = measured(box, at(0, 0, 1.5), box, at(0.1, 0, 0));
  EXPECT_NEAR(found.gap, -0.5, 1e-9);
  expect_equal(found.normal, {0, 0, 1}, 1e-6);
  EXPECT_NEAR(measured(of(Sphere{1}), at(0, 0, 0.6), of(Plane{}), {}).gap, -0.4, 1e-9);
}

TEST(ShapeDistance, EndsAtTheReach) {
  const Shape ball = of(Sphere{1});
  EXPECT_TRUE(distance_of({ball, at(5, 0, 0)}, {ball, {}}, 3.001));
  EXPECT_FALSE(distance_of({ball, at(5, 0, 0)}, {ball, {}}, 2.999));
  EXPECT_FALSE(distance_of({ball, at(0, 0, 5)}, {of(Plane{}), {}}, 3.999));
}

TEST(ShapeDistance, NeedsAConvexSide) {
  const Shape mesh = of(TriangleMesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 1, 2}});
  EXPECT_TRUE(check_distance(mesh, of(Box{})).ok());
  EXPECT_THAT(check_distance(mesh, of(Plane{})).message(), HasSubstr("from convex shapes alone"));
  EXPECT_THAT(check_distance(of(Box{}), of(Ground{})).message(), HasSubstr("ask what is near"));
  HeightField large{1000, 1000, {1, 1}, std::vector<double>(1'000'000)};
  EXPECT_THAT(check_distance(of(large), of(Box{})).message(), HasSubstr("at most 100000"));
}

}  // namespace
}  // namespace tessera
