#include "lpss/bullet/triangle_edges.h"

#include <gmock/gmock.h>

namespace tessera::bullet {
namespace {

using Eigen::Vector3d;

// A roof: two faces over the edge from `a` to `b`, in the plane z = 0 on one side and down at 45 degrees on
// the other.
const Vector3d kA(0, 0, 0);
const Vector3d kB(0, 1, 0);
const Vector3d kFlat(-1, 0, 0);
const Vector3d kSlope(1, 0, -1);
const Vector3d kUp(0, 0, 1);
const Vector3d kTilted = Vector3d(1, 0, 1).normalized();

TEST(TriangleEdges, NormalsAcrossSharedEdges) {
  TriangleEdges edges;
  edges.add(7, {kA, kB, kFlat});
  edges.add(8, {kB, kA, kSlope});
  edges.connect();
  EXPECT_LT((edges.across(7, 0).value() - kTilted).norm(), 1e-15);
  EXPECT_LT((edges.across(8, 0).value() - kUp).norm(), 1e-15);
  for (const int outer : {1, 2}) {
    EXPECT_EQ(edges.across(7, outer), std::nullopt);
    EXPECT_EQ(edges.across(8, outer), std::nullopt);
  }
  EXPECT_EQ(edges.across(9, 0), std::nullopt);
}

TEST(TriangleEdges, CornersNeedNotBeEqual) {
  TriangleEdges edges;
  edges.add(0, {kA, kB, kFlat});
  edges.add(1, {kB + Vector3d(5e-5, 0, 0), kA - Vector3d(0, 5e-5, 0), kSlope});
  edges.connect();
  EXPECT_TRUE(edges.across(0, 0).has_value());

  TriangleEdges apart;
  apart.add(0, {kA, kB, kFlat});
  apart.add(1, {kB + Vector3d(2e-4, 0, 0), kA, kSlope});
  apart.connect();
  EXPECT_FALSE(apart.across(0, 0).has_value());
}

TEST(TriangleEdges, ANeighbourThatWindsTheOtherWayIsTurned) {
  TriangleEdges edges;
  edges.add(0, {kA, kB, kFlat});
  edges.add(1, {kA, kB, kSlope});
  edges.connect();
  EXPECT_LT((edges.across(0, 0).value() - kTilted).norm(), 1e-15);
  EXPECT_LT((edges.across(1, 0).value() + kUp).norm(), 1e-15);
}

TEST(TriangleEdges, AnEdgeOfThreeIsAnOuterOneAndSliversHaveNone) {
  TriangleEdges edges;
  edges.add(0, {kA, kB, kFlat});
  edges.add(1, {kB, kA, kSlope});
  edges.add(2, {kA, kB, kUp});
  edges.add(3, {kB, kFlat, kB});
  edges.connect();
  EXPECT_FALSE(edges.across(0, 0).has_value());
  EXPECT_FALSE(edges.across(0, 1).has_value());
  EXPECT_FALSE(edges.across(3, 0).has_value());
}

}  // namespace
}  // namespace tessera::bullet
