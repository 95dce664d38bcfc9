// What is cut out of a large static shape is, within the region, the shape itself.
#include "lpss/partition/static_cut.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <set>
#include <tuple>
#include <vector>

namespace tessera {
namespace {

using Point = Eigen::Vector3d;

Eigen::Quaterniond turned(double angle, const Point& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis.normalized()));
}

Eigen::AlignedBox3d cube(const Point& centre, double half) {
  return {centre - Point::Constant(half), centre + Point::Constant(half)};
}

std::vector<Point> points_in(const Eigen::AlignedBox3d& region, int count) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<Point> result;
  for (int n = 0; n < count; ++n) {
    const Point at(share(random), share(random), share(random));
    result.push_back(region.min() + at.cwiseProduct(region.sizes()));
  }
  return result;
}

double height_over(const Plane& plane, const Pose& pose, const Point& p) {
  return (pose.orientation * plane.normal).dot(p - pose.position);
}

bool inside(const Box& box, const Pose& pose, const Point& p) {
  return ((pose.inverse() * p).cwiseAbs().array() <= box.size.array() / 2).all();
}

std::optional<ShapePart> cut_of(const Geometry& geometry, const Pose& pose,
                                const Eigen::AlignedBox3d& region) {
  const auto* mesh = std::get_if<TriangleMesh>(&geometry);
  const std::optional<MeshTree> tree = mesh == nullptr ? std::nullopt : std::optional<MeshTree>(*mesh);
  return cut_to(geometry, pose, region, tree ? &*tree : nullptr);
}

TEST(CutOfAPlane, IsTheSamePlaneFromNearby) {
  const Pose pose{{1e6, -2e6, 30}, turned(0.3, {1, 1, 0})};
  const Point foot = pose * Point(-1e6, 5e5, 0);
  const Eigen::AlignedBox3d region = cube(foot, 16);
  const auto part = cut_of(Plane{}, pose, region);
  ASSERT_TRUE(part);
  EXPECT_LT((part->pose.position - region.center()).norm(), region.sizes().norm());
  for (const Point& p : points_in(region, 50)) {
    EXPECT_NEAR(height_over(std::get<Plane>(part->geometry), part->pose, p), height_over(Plane{}, pose, p),
                1e-8);
  }
}

TEST(CutOfAPlane, IsThereWheneverTheHalfSpaceMayReachIntoTheRegion) {
  const double radius = cube({0, 0, 0}, 8).sizes().norm() / 2;
  const auto cut_at = [](double height) { return cut_of(Plane{}, {}, cube({0, 0, height}, 8)); };
  EXPECT_FALSE(cut_at(radius + 0.01));
  EXPECT_TRUE(cut_at(radius - 0.01));
  EXPECT_TRUE(cut_at(-1e6)) << "deep below the plane is inside the half space";
}

TEST(CutOfABox, IsNothingFarFromIt) {
  const Box box{{100, 100, 2}};
  EXPECT_FALSE(cut_of(box, {}, cube({0, 0, 20}, 8)));
  EXPECT_FALSE(cut_of(box, {}, cube({-70, 0, 0}, 8)));
  EXPECT_TRUE(cut_of(box, {}, cube({-57, 0, 0}, 8)));
}

TEST(CutOfABox, IsAllOfItWhereTheRegionIsLarge) {
  const Box box{{3, 4, 5}};
  const Pose pose{{1, 2, 3}, Eigen::Quaterniond::Identity()};
  const auto part = cut_of(box, pose, cube({0, 0, 0}, 16));
  ASSERT_TRUE(part);
  EXPECT_EQ(std::get<Box>(part->geometry).size, box.size);
  EXPECT_EQ(part->pose.position, pose.position);
}

TEST(CutOfABox, IsTheSameWithinTheRegionAndEndsWellOutsideOfIt) {
  const Box box{{1e5, 8e4, 20}};
  const std::vector<Pose> poses = {{{3e4, 2e4, -10}, Eigen::Quaterniond::Identity()},
                                   {{3e4, 2e4, -10}, turned(0.4, {0, 0, 1})},
                                   {{0, 0, 0}, turned(1.1, {1, 2, 3})}};
  for (const Pose& pose : poses) {
    // Around the surface, and around an edge.
    for (const Point& local : {Point(2e4, -1e4, 10), Point(5e4, 1e4, 10)}) {
      const Eigen::AlignedBox3d region = cube(pose * local, 16);
      const auto part = cut_of(box, pose, region);
      ASSERT_TRUE(part);
      const Box& cut = std::get<Box>(part->geometry);
      EXPECT_LT((part->pose.position - region.center()).norm(), 300) << "its origin is near the region";
      EXPECT_LT(cut.size.maxCoeff(), 300);
      for (const Point& p : points_in(region, 200)) {
        EXPECT_EQ(inside(cut, part->pose, p), inside(box, pose, p));
      }
      // A face that the whole box does not have is farther away than the region is wide.
      for (const Point& p : points_in(cube(region.center(), 40), 200)) {
        EXPECT_EQ(inside(cut, part->pose, p), inside(box, pose, p));
      }
    }
  }
}

// A floor of two triangles a cell, one metre each, gently waved.
TriangleMesh waves(int cells) {
  TriangleMesh mesh;
  for (int row = 0; row <= cells; ++row) {
    for (int column = 0; column <= cells; ++column) {
      mesh.vertices.emplace_back(column - cells / 2, row - cells / 2, 0.25 * ((row + 2 * column) % 3));
    }
  }
  const auto vertex = [&](int row, int column) {
    return static_cast<std::uint32_t>(row * (cells + 1) + column);
  };
  for (int row = 0; row < cells; ++row) {
    for (int column = 0; column < cells; ++column) {
      const std::uint32_t a = vertex(row, column);
      const std::uint32_t b = vertex(row, column + 1);
      const std::uint32_t c = vertex(row + 1, column + 1);
      const std::uint32_t d = vertex(row + 1, column);
      mesh.indices.insert(mesh.indices.end(), {a, b, c, a, c, d});
    }
  }
  return mesh;
}

// A triangle by its corners in the sector's frame, in units of 1e-6 m.
using Corner = std::tuple<std::int64_t, std::int64_t, std::int64_t>;
using Triangle = std::array<Corner, 3>;

Triangle triangle_of(const TriangleMesh& mesh, const Pose& pose, std::size_t first) {
  Triangle result;
  for (std::size_t n = 0; n < 3; ++n) {
    const Point p = pose * mesh.vertices[mesh.indices[first + n]];
    result[n] = {std::llround(p.x() * 1e6), std::llround(p.y() * 1e6), std::llround(p.z() * 1e6)};
  }
  return result;
}

std::vector<Triangle> triangles_of(const TriangleMesh& mesh, const Pose& pose) {
  std::vector<Triangle> result;
  for (std::size_t first = 0; first < mesh.indices.size(); first += 3) {
    result.push_back(triangle_of(mesh, pose, first));
  }
  return result;
}

// Whether one of many points of the triangle is in the region.
bool any_point_in(const Eigen::AlignedBox3d& region, const Point& a, const Point& b, const Point& c) {
  constexpr int kSteps = 8;
  for (int n = 0; n <= kSteps; ++n) {
    for (int m = 0; n + m <= kSteps; ++m) {
      if (region.contains(a + (b - a) * n / kSteps + (c - a) * m / kSteps)) return true;
    }
  }
  return false;
}

TEST(CutOfAMesh, HasEveryTriangleThatMayReachIntoTheRegionAndNoneFarFromIt) {
  const TriangleMesh mesh = waves(60);
  for (const Pose& pose : {Pose{{5, 6, 0}, Eigen::Quaterniond::Identity()},
                           Pose{{5, 6, 0}, turned(std::numbers::pi / 2, {0, 0, 1})},
                           Pose{{1, 2, 3}, turned(0.7, {1, 0.5, 0.2})}}) {
    const Eigen::AlignedBox3d region = cube(pose * Point(10, -8, 0), 4.1);
    const auto part = cut_of(mesh, pose, region);
    ASSERT_TRUE(part);
    const auto& cut = std::get<TriangleMesh>(part->geometry);
    const std::vector<Triangle> found = triangles_of(cut, part->pose);
    const std::set<Triangle> kept(found.begin(), found.end());
    EXPECT_EQ(kept.size(), found.size()) << "each triangle once";
    for (std::size_t first = 0; first < mesh.indices.size(); first += 3) {
      const Point a = pose * mesh.vertices[mesh.indices[first]];
      const Point b = pose * mesh.vertices[mesh.indices[first + 1]];
      const Point c = pose * mesh.vertices[mesh.indices[first + 2]];
      const bool near = any_point_in(region, a, b, c);
      const Eigen::AlignedBox3d bounds = Eigen::AlignedBox3d(a).extend(b).extend(c);
      const bool far = bounds.exteriorDistance(region) > region.sizes().norm();
      const bool is_kept = kept.contains(triangle_of(mesh, pose, first));
      EXPECT_TRUE(!near || is_kept);
      EXPECT_FALSE(far && is_kept);
    }
    std::set<std::uint32_t> used(cut.indices.begin(), cut.indices.end());
    EXPECT_EQ(used.size(), cut.vertices.size()) << "no vertex without a triangle, none twice";
    EXPECT_EQ(*used.rbegin() + 1, cut.vertices.size());
  }
}

TEST(CutOfAMesh, HasSmallNumbersHoweverFarItsOriginIs) {
  TriangleMesh mesh = waves(4);
  for (Point& vertex : mesh.vertices) vertex.x() += 1 << 20;
  const Pose pose{{-(1 << 20), 0, 0}, Eigen::Quaterniond::Identity()};
  const auto part = cut_of(mesh, pose, cube({0, 0, 0}, 4));
  ASSERT_TRUE(part);
  EXPECT_LT(part->pose.position.norm(), 8);
  for (const Point& vertex : std::get<TriangleMesh>(part->geometry).vertices) EXPECT_LT(vertex.norm(), 8);
  EXPECT_EQ(triangles_of(std::get<TriangleMesh>(part->geometry), part->pose), triangles_of(mesh, pose));
}

TEST(CutOfAMesh, IsNothingWhereNoTriangleIs) {
  EXPECT_FALSE(cut_of(waves(4), {}, cube({0, 0, 10}, 4)));
  EXPECT_FALSE(cut_of(waves(4), {}, cube({20, 0, 0}, 4)));
}

HeightField hills(std::uint32_t columns, std::uint32_t rows, const Eigen::Vector2d& spacing, double level) {
  HeightField field{columns, rows, spacing, {}};
  for (std::uint32_t row = 0; row < rows; ++row) {
    for (std::uint32_t column = 0; column < columns; ++column) {
      field.heights.push_back(level + 0.25 * ((3 * row + 5 * column) % 7));
    }
  }
  return field;
}

Point sample(const HeightField& field, const Pose& pose, std::uint32_t column, std::uint32_t row) {
  return pose * Point((column - (field.columns - 1) / 2.0) * field.spacing.x(),
                      (row - (field.rows - 1) / 2.0) * field.spacing.y(),
                      field.heights[row * field.columns + column]);
}

TEST(CutOfAHeightField, HasTheSamplesThatSurroundTheRegionInTheirPlaces) {
  const HeightField field = hills(101, 64, {1, 2}, 0);
  const Pose pose{{7, -3, 1}, Eigen::Quaterniond::Identity()};
  const Eigen::AlignedBox3d region = cube({20.3, 11.2, 0}, 4);
  const auto part = cut_of(field, pose, region);
  ASSERT_TRUE(part);
  const auto& cut = std::get<HeightField>(part->geometry);
  EXPECT_EQ(cut.spacing, field.spacing);
  ASSERT_EQ(cut.heights.size(), cut.columns * cut.rows);
  std::set<Corner> original;
  const auto corner = [](const Point& p) {
    return Corner{std::llround(p.x() * 1e6), std::llround(p.y() * 1e6), std::llround(p.z() * 1e6)};
  };
  for (std::uint32_t row = 0; row < field.rows; ++row) {
    for (std::uint32_t column = 0; column < field.columns; ++column) {
      original.insert(corner(sample(field, pose, column, row)));
    }
  }
  Eigen::AlignedBox3d covered;
  for (std::uint32_t row = 0; row < cut.rows; ++row) {
    for (std::uint32_t column = 0; column < cut.columns; ++column) {
      const Point p = sample(cut, part->pose, column, row);
      EXPECT_TRUE(original.contains(corner(p)));
      covered.extend(p);
    }
  }
  for (int axis = 0; axis < 2; ++axis) {
    EXPECT_LE(covered.min()[axis], region.min()[axis]);
    EXPECT_GE(covered.max()[axis], region.max()[axis]);
    EXPECT_GT(covered.min()[axis], region.min()[axis] - field.spacing[axis]) << "no more than a cell beyond";
    EXPECT_LT(covered.max()[axis], region.max()[axis] + field.spacing[axis]);
  }
}

TEST(CutOfAHeightField, EndsWhereTheFieldEnds) {
  const HeightField field = hills(21, 21, {1, 1}, 0);
  const auto part = cut_of(field, {}, cube({-10, 10, 0}, 4));
  ASSERT_TRUE(part);
  const auto& cut = std::get<HeightField>(part->geometry);
  EXPECT_EQ(cut.columns, 5u);
  EXPECT_EQ(cut.rows, 5u);
  EXPECT_EQ(sample(cut, part->pose, 0, 4).head<2>(), Eigen::Vector2d(-10, 10));
  EXPECT_FALSE(cut_of(field, {}, cube({-15, 0, 0}, 4)));
  EXPECT_FALSE(cut_of(field, {}, cube({0, 40, 0}, 4)));
}

TEST(CutOfAHeightField, CountsHeightsFromTheMiddleOfTheRegion) {
  const double summit = 1 << 20;
  const HeightField field = hills(21, 21, {1, 1}, summit);
  const auto part = cut_of(field, {{0, 0, -summit}, Eigen::Quaterniond::Identity()}, cube({0, 0, 0}, 4));
  ASSERT_TRUE(part);
  EXPECT_LT(part->pose.position.norm(), 4);
  for (const double height : std::get<HeightField>(part->geometry).heights) EXPECT_LE(std::abs(height), 1.5);
}

TEST(CutOfOtherShapes, IsTheWholeOfThem) {
  const Pose pose{{1000, 0, 0}, turned(0.5, {0, 1, 0})};
  const auto part = cut_of(Sphere{3}, pose, cube({0, 0, 0}, 8));
  ASSERT_TRUE(part);
  EXPECT_EQ(std::get<Sphere>(part->geometry).radius, 3);
  EXPECT_EQ(part->pose.position, pose.position);
  EXPECT_EQ(part->pose.orientation.coeffs(), pose.orientation.coeffs());
}

// Where the parts of two sectors overlap, they have the same triangles under the same names, in the same
// order.
TEST(Ground, IsTheSameInAllParts) {
  TileStore store({.threads = 0});
  const Ground planet{.source = Ground::Source::kPlanet,
                      .spacing = 16,
                      .radius = 6371000,
                      .height = 200,
                      .wavelength = 4000,
                      .octaves = 5};
  const TileStore::SourceRef source = store.open(planet).value();
  // Near a corner of the cube that its tiles are on, and turned.
  const Eigen::Quaterniond orientation = turned(0.4, {1, 2, 3});
  const Point up = orientation * Point(1, 1, 1).normalized();
  const auto cut_at = [&](const Point& sector) {
    const Pose pose{-up * planet.radius - sector, orientation};
    std::optional<ShapePart> part = cut_ground_to(store, *source, pose, cube({0, 0, 0}, 192));
    EXPECT_TRUE(part.has_value());
    TriangleMesh mesh = std::get<TriangleMesh>(part->geometry);
    for (Point& vertex : mesh.vertices) vertex = part->pose * vertex + sector;
    return mesh;
  };
  const TriangleMesh here = cut_at({0, 0, 0});
  const TriangleMesh there = cut_at({128, -128, 0});
  ASSERT_EQ(here.names.size(), here.indices.size() / 3);
  EXPECT_EQ(std::set<std::uint32_t>(here.names.begin(), here.names.end()).size(), here.names.size());
  std::size_t place = 0;
  std::size_t common = 0;
  for (std::size_t n = 0; n < there.names.size(); ++n) {
    const auto found =
        std::find(here.names.begin() + static_cast<std::ptrdiff_t>(place), here.names.end(), there.names[n]);
    if (found == here.names.end()) {
      EXPECT_EQ(std::count(here.names.begin(), here.names.end(), there.names[n]), 0) << "another order";
      continue;
    }
    place = static_cast<std::size_t>(found - here.names.begin());
    ++common;
    for (std::size_t corner = 0; corner < 3; ++corner) {
      EXPECT_LT(
          (there.vertices[there.indices[3 * n + corner]] - here.vertices[here.indices[3 * place + corner]])
              .norm(),
          1e-8);
    }
  }
  EXPECT_GT(common, 100u);
}

TEST(Ground, IsNotWhereItIsNot) {
  TileStore store({.threads = 0});
  const TileStore::SourceRef source = store.open({.spacing = 8, .height = 20, .wavelength = 400}).value();
  EXPECT_FALSE(
      cut_ground_to(store, *source, {{0, 0, -300}, Eigen::Quaterniond::Identity()}, cube({0, 0, 0}, 192)));
  EXPECT_EQ(store.counts().made, 0u);
}

}  // namespace
}  // namespace tessera
