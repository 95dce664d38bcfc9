// The convex hull of points, whole or simplified.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "lpss/collision/shapes.h"

namespace tessera::collision {

struct HullTriangles {
  std::vector<Eigen::Vector3d> vertices;    // of the points given, in their order
  std::vector<std::vector<int>> triangles;  // counter-clockwise seen from outside
  // By triangle: a larger one beside it is in the same plane.
  std::vector<bool> is_repeated;
  double error = 0;  // m, no point is farther outside
};

struct HullDetail {
  double tolerance = 0;  // m, points may be so far outside; 0: none is
  // There are at most so many vertices, wherever points are then.
  std::size_t vertices_max = std::numeric_limits<std::size_t>::max();
};

// Empty if all points lie in a plane.
//
// Points are taken as numbers of 38 bits each, by their extent, with which the hull is exact: no two planes
// are mixed up, whatever lies in a plane or on a line. So the bits of the result depend on the points alone.
// A simplified hull grows point by point, each the one that is farthest outside, until what is outside is
// within the tolerance: its vertices are points of the whole one, and it lies inside of that.
//
// Source: Barber et al., The Quickhull Algorithm for Convex Hulls, 1996.
HullTriangles convex_hull(std::span<const Eigen::Vector3d> points, const HullDetail& detail = {});

// The half spaces of which a whole hull is what all share: one a facet, but for those of which the
// others say as much.
std::vector<HalfSpace<double>> planes_of(const HullTriangles& hull);

}  // namespace tessera::collision
