// What the pairs of shapes share: a view of a polyhedron, and distances of points, segments and polyhedra.
// All in the axes of the polyhedron, or of the first of two.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "lpss/collision/manifold.h"
#include "lpss/collision/shapes.h"

namespace tessera::collision {

// Preferences, as a share of the smaller thickness of two shapes.
inline constexpr double kFaceBias = 0.005;  // of a's faces to b's
inline constexpr double kEdgeBias = 0.01;   // of faces to edges

// Edges with a smaller sine of their angle are parallel: faces decide.
inline constexpr double kParallelSine = 1e-3;

// A view of the arrays of a polyhedron.
template <typename Scalar>
struct Hull {
  std::span<const Vector3<Scalar>> vertices;
  std::span<const HalfSpace<Scalar>> planes;
  std::span<const FaceLoop> faces;
  const std::uint16_t* corners;
  std::span<const HullEdge> edges;
  Scalar thickness;
};

template <typename Scalar>
Hull<Scalar> view(const Polyhedron<Scalar>& polyhedron) {
  return {polyhedron.vertices,       polyhedron.planes, polyhedron.faces,
          polyhedron.corners.data(), polyhedron.edges,  polyhedron.thickness};
}

// A box as a polyhedron. Bit k of the index of a vertex is set on the positive side of axis k; face 2 k + 1
// is at the positive end of axis k, face 2 k at the other.
inline constexpr std::uint16_t kBoxCorners[24] = {0, 4, 6, 2, 1, 3, 7, 5, 0, 1, 5, 4,
                                                  2, 6, 7, 3, 0, 2, 3, 1, 4, 5, 7, 6};
inline constexpr FaceLoop kBoxFaces[6] = {{0, 4}, {4, 4}, {8, 4}, {12, 4}, {16, 4}, {20, 4}};
// Along x, y, z: four each.
inline constexpr HullEdge kBoxEdges[12] = {{0, 1, 2, 4}, {2, 3, 4, 3}, {4, 5, 5, 2}, {6, 7, 3, 5},
                                           {0, 2, 4, 0}, {1, 3, 1, 4}, {4, 6, 0, 5}, {5, 7, 5, 1},
                                           {0, 4, 0, 2}, {1, 5, 2, 1}, {2, 6, 3, 0}, {3, 7, 1, 3}};

template <typename Scalar>
Vector3<Scalar> box_vertex(const Vector3<Scalar>& half, int index) {
  return {index & 1 ? half.x() : -half.x(), index & 2 ? half.y() : -half.y(),
          index & 4 ? half.z() : -half.z()};
}

template <typename Scalar>
struct BoxHull {
  explicit BoxHull(const Vector3<Scalar>& half) : thickness(half.minCoeff()) {
    for (int n = 0; n < 8; ++n) vertex[n] = box_vertex(half, n);
    for (int k = 0; k < 3; ++k) {
      plane[2 * k] = {-Vector3<Scalar>::Unit(k), half[k]};
      plane[2 * k + 1] = {Vector3<Scalar>::Unit(k), half[k]};
    }
  }
  Hull<Scalar> view() const { return {vertex, plane, kBoxFaces, kBoxCorners, kBoxEdges, thickness}; }

  Vector3<Scalar> vertex[8];
  HalfSpace<Scalar> plane[6];
  Scalar thickness;
};

// The least height along a direction.
template <typename Scalar>
Scalar lowest(std::span<const Vector3<Scalar>> points, const Vector3<Scalar>& direction) {
  Scalar least = std::numeric_limits<Scalar>::max();
  for (const Vector3<Scalar>& p : points) least = std::min(least, direction.dot(p));
  return least;
}

// How the normals of the faces of a polyhedron lean along a direction.
template <typename Scalar>
struct Slopes {
  void find(const Hull<Scalar>& hull, const Vector3<Scalar>& direction) {
    for (std::size_t f = 0; f < hull.planes.size(); ++f) of[f] = hull.planes[f].normal.dot(direction);
  }

  Scalar of[kHullFacesMax];
};

template <typename Scalar>
int supporting_face_index(const Hull<Scalar>& hull, const Vector3<Scalar>& direction) {
  int best = 0;
  Scalar most = std::numeric_limits<Scalar>::lowest();
  for (int f = 0; f < static_cast<int>(hull.planes.size()); ++f) {
    const Scalar alignment = hull.planes[f].normal.dot(direction);
    if (alignment > most) {
      most = alignment;
      best = f;
    }
  }
  return best;
}

template <typename Scalar>
Face<Scalar> face_of(const Hull<Scalar>& hull, int f) {
  Face<Scalar> face;
  face.normal = hull.planes[f].normal;
  face.id = f;
  face.count = hull.faces[f].count;
  const std::uint16_t* corner = hull.corners + hull.faces[f].first;
  for (int n = 0; n < face.count; ++n) {
    face.vertex[n] = hull.vertices[corner[n]];
    face.vertex_id[n] = corner[n];
  }
  return face;
}

// The closest points p + s d of two segments, s from 0 to 1 (Ericson, 5.1.9).
template <typename Scalar>
struct ClosestSegments {
  ClosestSegments(const Vector3<Scalar>& p, const Vector3<Scalar>& d, const Vector3<Scalar>& q,
                  const Vector3<Scalar>& e) {
    const Vector3<Scalar> r = p - q;
    const Scalar dd = d.dot(d);
    const Scalar ee = e.dot(e);
    const Scalar de = d.dot(e);
    const Scalar dr = d.dot(r);
    const Scalar er = e.dot(r);
    const Scalar area = d.cross(e).squaredNorm();
    s = area > Scalar(1e-12) * dd * ee ? std::clamp((de * er - dr * ee) / area, Scalar(0), Scalar(1))
                                       : Scalar(0.5);
    t = ee > 0 ? (de * s + er) / ee : Scalar(0);
    if (t < 0 || t > 1) {
      t = std::clamp(t, Scalar(0), Scalar(1));
      s = dd > 0 ? std::clamp((de * t - dr) / dd, Scalar(0), Scalar(1)) : Scalar(0);
    }
    on_a = p + s * d;
    on_b = q + t * e;
  }

  // Whether both are between the ends of their segments.
  bool is_inside() const { return s > 0 && s < 1 && t > 0 && t < 1; }

  Scalar s;
  Scalar t;
  Vector3<Scalar> on_a;
  Vector3<Scalar> on_b;
};

// The point of a convex polygon, whose plane and normal are given, that is closest to `p`.
template <typename Scalar>
Vector3<Scalar> closest_on_face(const Hull<Scalar>& hull, int f, const Vector3<Scalar>& p, bool& is_inside) {
  const HalfSpace<Scalar>& plane = hull.planes[f];
  const std::uint16_t* corner = hull.corners + hull.faces[f].first;
  const int count = hull.faces[f].count;
  is_inside = true;
  Vector3<Scalar> best = p - (plane.normal.dot(p) - plane.offset) * plane.normal;
  Scalar least = std::numeric_limits<Scalar>::max();
  for (int n = 0; n < count; ++n) {
    const Vector3<Scalar>& tail = hull.vertices[corner[n]];
    const Vector3<Scalar> edge = hull.vertices[corner[n + 1 < count ? n + 1 : 0]] - tail;
    const Vector3<Scalar> from_tail = p - tail;
    if (edge.cross(plane.normal).dot(from_tail) <= 0) continue;
    is_inside = false;
    const Scalar along = std::clamp(edge.dot(from_tail) / edge.squaredNorm(), Scalar(0), Scalar(1));
    const Vector3<Scalar> candidate = tail + along * edge;
    const Scalar distance = (p - candidate).squaredNorm();
    if (distance < least) {
      least = distance;
      best = candidate;
    }
  }
  return best;
}

// The face of which the plane is farthest below `p`, and the height above it.
template <typename Scalar>
Scalar height_above(const Hull<Scalar>& hull, const Vector3<Scalar>& p, int& face) {
  Scalar most = std::numeric_limits<Scalar>::lowest();
  for (int f = 0; f < static_cast<int>(hull.planes.size()); ++f) {
    const Scalar height = hull.planes[f].normal.dot(p) - hull.planes[f].offset;
    if (height > most) {
      most = height;
      face = f;
    }
  }
  return most;
}

// The point of a polyhedron that is closest to `p`, which is outside, `face` being that of height_above().
// `is_on_face` tells whether it is in that face, not on an edge.
template <typename Scalar>
Vector3<Scalar> closest_on_hull(const Hull<Scalar>& hull, const Vector3<Scalar>& p, int face,
                                bool& is_on_face) {
  Vector3<Scalar> best = closest_on_face(hull, face, p, is_on_face);
  if (is_on_face) return best;
  bool is_inside = false;
  Scalar least = (p - best).squaredNorm();
  for (int f = 0; f < static_cast<int>(hull.planes.size()); ++f) {
    if (f == face || hull.planes[f].normal.dot(p) <= hull.planes[f].offset) continue;
    const Vector3<Scalar> candidate = closest_on_face(hull, f, p, is_inside);
    const Scalar distance = (p - candidate).squaredNorm();
    if (distance < least) {
      least = distance;
      best = candidate;
    }
  }
  return best;
}

// A contact with results in the axes of a, not yet in those of the world.
template <typename Scalar>
void turn(const Matrix3<Scalar>& rotation, Manifold<Scalar>& manifold) {
  if (manifold.count == 0) return;
  manifold.normal = rotation * manifold.normal;
  for (int n = 0; n < manifold.count; ++n) {
    ContactPoint<Scalar>& point = manifold.point[n];
    point.on_a = rotation * point.on_a;
    point.on_b = rotation * point.on_b;
  }
}

// The edges of two shapes, for the closest points where they are apart and no faces are opposite each other.
template <typename Scalar>
struct EdgeSet {
  std::span<const Vector3<Scalar>> vertices;  // in the axes of a
  std::span<const HullEdge> edges;
};

// Fills in the closest points of the edges of two shapes that are apart, if they are within `margin`. Where
// they nearly touch, rounding would decide on the direction between them: `normal`, from b to a, is taken
// instead.
template <typename Scalar>
void closest_edges(const EdgeSet<Scalar>& a, const EdgeSet<Scalar>& b, const Vector3<Scalar>& normal,
                   Scalar margin, Manifold<Scalar>& manifold);

// Two polyhedra; b's axes to a's: x -> rotation x + offset. The result is in a's axes.
template <typename Scalar>
Manifold<Scalar> collide_hulls(const Hull<Scalar>& a, const Hull<Scalar>& b, const Matrix3<Scalar>& rotation,
                               const Vector3<Scalar>& offset, Scalar margin);

}  // namespace tessera::collision
