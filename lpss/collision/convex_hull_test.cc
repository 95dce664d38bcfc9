// The hull of any points is closed, convex and holds them all; a simplified one is as close as it says.
#include "lpss/collision/convex_hull.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <set>
#include <utility>

namespace tessera::collision {
namespace {

using Points = std::vector<Eigen::Vector3d>;

Points turned(Points points) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  for (Eigen::Vector3d& p : points) p = turn * p + Eigen::Vector3d(3, -4, 5);
  return points;
}

Points ball(int count) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  Points points;
  while (static_cast<int>(points.size()) < count)
    points.push_back(Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized());
  return points;
}

Points prism_points(int sides, double radius, double height) {
  Points points;
  for (int n = 0; n < sides; ++n) {
    const double angle = 2 * std::numbers::pi * n / sides;
    for (const double z : {0., height})
      points.push_back({radius * std::cos(angle), radius * std::sin(angle), z});
  }
  return points;
}

Points lattice(int side) {
  Points points;
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      for (int k = 0; k < side; ++k) points.push_back({i * 0.1, j * 0.1, k * 0.1});
    }
  }
  return points;
}

double extent(const Points& points) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : points) box.extend(p);
  return box.sizes().maxCoeff();
}

// m, how far the farthest of the points is above a plane of the hull.
double most_above(const HullTriangles& hull, const Points& points) {
  double most = -1;
  for (const HalfSpace<double>& plane : planes_of(hull)) {
    for (const Eigen::Vector3d& p : points) most = std::max(most, plane.normal.dot(p) - plane.offset);
  }
  return most;
}

void expect_closed(const HullTriangles& hull) {
  std::set<std::pair<int, int>> edges;
  for (const std::vector<int>& triangle : hull.triangles) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_TRUE(edges.emplace(triangle[k], triangle[(k + 1) % 3]).second);
  }
  for (const auto& [tail, head] : edges) EXPECT_TRUE(edges.contains({head, tail}));
  EXPECT_EQ(hull.triangles.size() + 4, 2 * hull.vertices.size()) << "Euler";
}

TEST(ConvexHull, OfAnyPointsIsClosedAndHoldsThem) {
  const Points line_of_rings = [] {
    Points points;
    for (int ring = 0; ring < 100; ++ring) {
      for (int n = 0; n < 16; ++n) {
        const double angle = std::numbers::pi * n / 8;
        points.push_back({0.1 * std::cos(angle), 0.1 * std::sin(angle), 0.01 * ring});
      }
    }
    return points;
  }();
  for (const Points& upright : {ball(50), ball(2000), prism_points(129, 0.0317, 0.115), lattice(9),
                                line_of_rings, prism_points(500, 1, 0.001)}) {
    for (const Points& points : {upright, turned(upright)}) {
      const HullTriangles hull = convex_hull(points);
      expect_closed(hull);
      EXPECT_EQ(hull.error, 0);
      EXPECT_LE(most_above(hull, points), 1e-10 * extent(points)) << points.size();
    }
  }
}

TEST(ConvexHull, FindsTheCornersAndPlanesOfABoxAmongThePointsInIt) {
  const HullTriangles upright = convex_hull(lattice(9));
  EXPECT_EQ(upright.vertices.size(), 8u);
  EXPECT_EQ(planes_of(upright).size(), 6u);
  const HullTriangles hull = convex_hull(turned(lattice(9)));
  const auto polyhedron = make_polyhedron<double>(hull.vertices, hull.triangles);
  ASSERT_TRUE(polyhedron);
  EXPECT_EQ(polyhedron->vertices.size(), 8u);
  EXPECT_EQ(polyhedron->faces.size(), 6u);
}

TEST(ConvexHull, HasNoneWherePointsAreInAPlane) {
  EXPECT_TRUE(convex_hull({}).vertices.empty());
  EXPECT_TRUE(convex_hull(Points{{1, 2, 3}}).vertices.empty());
  EXPECT_TRUE(convex_hull(Points(7, Eigen::Vector3d(1, 2, 3))).vertices.empty());
  EXPECT_TRUE(convex_hull(Points{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {5, 5, 5}}).vertices.empty());
  EXPECT_TRUE(convex_hull(Points{{0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}}).vertices.empty());
}

TEST(ConvexHull, DoesNotDependOnTheOrderOfItsPointsButForTheirNumbers) {
  Points points = turned(ball(300));
  const auto sorted_corners = [](const HullTriangles& hull) {
    std::vector<std::array<double, 3>> corners;
    for (const Eigen::Vector3d& v : hull.vertices) corners.push_back({v.x(), v.y(), v.z()});
    std::sort(corners.begin(), corners.end());
    return corners;
  };
  const auto before = sorted_corners(convex_hull(points, {.tolerance = 0.01}));
  std::mt19937 random(3);
  std::shuffle(points.begin(), points.end(), random);
  EXPECT_EQ(sorted_corners(convex_hull(points, {.tolerance = 0.01})), before);
}

// Distances from the hull by many directions: how much farther the points reach.
TEST(ConvexHull, IsSimplifiedWithinTheErrorThatItStates) {
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  for (const Points& points : {ball(2000), prism_points(1000, 1, 0.1), turned(prism_points(300, 0.1, 2))}) {
    for (const double tolerance : {1e-3, 1e-2}) {
      const HullTriangles hull = convex_hull(points, {tolerance, 500});
      expect_closed(hull);
      EXPECT_LE(hull.vertices.size(), 500u);
      EXPECT_TRUE(hull.error <= tolerance || hull.vertices.size() == 500u) << hull.error;
      double most = 0;
      for (int n = 0; n < 2000; ++n) {
        const Eigen::Vector3d direction =
            Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
        double of_points = -1e9;
        double of_hull = -1e9;
        for (const Eigen::Vector3d& p : points) of_points = std::max(of_points, direction.dot(p));
        for (const Eigen::Vector3d& p : hull.vertices) of_hull = std::max(of_hull, direction.dot(p));
        most = std::max(most, of_points - of_hull);
      }
      EXPECT_LE(most, hull.error + 1e-12);
    }
  }
}

}  // namespace
}  // namespace tessera::collision
