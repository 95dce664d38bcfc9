#include "lpss/collision/manifold.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "lpss/collision/test_shapes.h"

namespace tessera::collision {
namespace {

using Point = ContactPoint<double>;

Point at(double x, double y, double gap, std::uint32_t feature) {
  return {{x, y, gap}, {x, y, 0}, gap, feature};
}

Manifold<double> reduced(const std::vector<Point>& points) {
  Manifold<double> manifold;
  manifold.normal = Eigen::Vector3d::UnitZ();
  reduce(std::span<const Point>(points), manifold);
  return manifold;
}

std::set<std::uint32_t> features(const Manifold<double>& manifold) {
  std::set<std::uint32_t> result;
  for (int n = 0; n < manifold.count; ++n) result.insert(manifold.point[n].feature);
  return result;
}

TEST(Reduce, KeepsTheCornersOfTheCoveredArea) {
  std::vector<Point> points{at(0, 0, -0.1, 1),   at(1, 0, -0.1, 2),   at(1, 1, -0.1, 3),    at(0, 1, -0.1, 4),
                            at(0.5, 0, -0.1, 5), at(0.5, 1, -0.1, 6), at(0.5, 0.5, -0.1, 7)};
  EXPECT_EQ(features(reduced(points)), (std::set<std::uint32_t>{1, 2, 3, 4}));
  // In any order.
  std::reverse(points.begin(), points.end());
  EXPECT_EQ(features(reduced(points)), (std::set<std::uint32_t>{1, 2, 3, 4}));
}

TEST(Reduce, TheDeepestStays) {
  const std::vector<Point> points{at(0, 0, -0.1, 1), at(1, 0, -0.1, 2), at(1, 1, -0.1, 3), at(0, 1, -0.1, 4),
                                  at(0.5, 0.5, -0.2, 5)};
  EXPECT_TRUE(features(reduced(points)).contains(5));
}

TEST(Reduce, OverlapsComeFirst) {
  const std::vector<Point> points{at(0.4, 0.4, -0.1, 1), at(0.6, 0.4, -0.1, 2), at(0.6, 0.6, -0.1, 3),
                                  at(0.4, 0.6, -0.1, 4), at(0, 0, 0.01, 5),     at(1, 1, 0.01, 6)};
  EXPECT_EQ(features(reduced(points)), (std::set<std::uint32_t>{1, 2, 3, 4}));
}

TEST(Reduce, PointsOnALineAreTwo) {
  const std::vector<Point> points{at(0, 0, 0, 1), at(1, 0, 0, 2), at(2, 0, 0, 3), at(3, 0, 0, 4),
                                  at(4, 0, 0, 5)};
  EXPECT_EQ(features(reduced(points)), (std::set<std::uint32_t>{1, 5}));
}

TEST(ClipFaces, MeetsWhereTheFacesCoverEachOther) {
  const Box<double> large{{1, 1, 1}};
  const Box<double> small{{0.5, 0.5, 0.5}};
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const Face<double> bottom = supporting_face(small, Eigen::Vector3d(-up));
  // Shifted to cover a quarter of a face, below by 0.01.
  const Face<double> top = placed(supporting_face(large, up), Eigen::Matrix3d(Eigen::Matrix3d::Identity()),
                                  Eigen::Vector3d(1, 1, -1.51));
  const Manifold<double> manifold = clip_faces(bottom, top, up, 0.02);
  ASSERT_EQ(manifold.count, 4);
  std::set<Touch> kinds;
  for (const Point& p : manifold.point) {
    EXPECT_NEAR(p.gap, 0.01, 1e-12);
    EXPECT_NEAR(p.on_a.z(), -0.5, 1e-12);
    EXPECT_NEAR(p.on_b.z(), -0.51, 1e-12);
    EXPECT_GE(std::min(p.on_a.x(), p.on_a.y()), -1e-12);
    EXPECT_LE(std::max(p.on_a.x(), p.on_a.y()), 0.5 + 1e-12);
    kinds.insert(static_cast<Touch>(p.feature >> 30));
  }
  // A corner of each, and two crossings.
  EXPECT_EQ(kinds, (std::set<Touch>{Touch::kVertexA, Touch::kVertexB, Touch::kCrossing}));
  EXPECT_EQ(clip_faces(bottom, top, up, 0.005).count, 0);
}

TEST(ClipFaces, FacesBesideEachOtherDoNotMeet) {
  const Box<double> box{{0.5, 0.5, 0.5}};
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const Face<double> bottom = supporting_face(box, Eigen::Vector3d(-up));
  const Face<double> top = placed(supporting_face(box, up), Eigen::Matrix3d(Eigen::Matrix3d::Identity()),
                                  Eigen::Vector3d(1.1, 0, -1));
  EXPECT_EQ(clip_faces(bottom, top, up, 0.02).count, 0);
}

}  // namespace
}  // namespace tessera::collision
