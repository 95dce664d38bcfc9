// Contact points of two convex shapes, and how faces give them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <type_traits>

#include "lpss/collision/shapes.h"

namespace tessera::collision {

template <typename Scalar>
struct ContactPoint {
  Vector3<Scalar> on_a;  // m, on the surface of a, relative to the centre of a, world axes
  Vector3<Scalar> on_b;  // on the surface of b; likewise relative to the centre of a
  Scalar gap;            // m, (on_a - on_b) . normal: negative where the shapes overlap
  // What touches: the same as long as the same vertices, edges and faces do, and unique within the manifold.
  std::uint32_t feature;
};

// Points that share a normal.
template <typename Scalar>
struct Manifold {
  // Unit length, from b to a, world axes; of meaning if there are points.
  Vector3<Scalar> normal = Vector3<Scalar>::Zero();
  int count = 0;
  ContactPoint<Scalar> point[4];
};

// A contact with a and b exchanged; `offset` is of the placement of the given manifold.
template <typename Scalar>
Manifold<Scalar> swapped(const Manifold<Scalar>& manifold, const Vector3<Scalar>& offset);

// What a feature is made of; `a` and `b` are indices below 2^15.
enum class Touch : std::uint32_t {
  kEdges = 0,     // the closest points of an edge of a and one of b, or of their ends
  kVertexB = 1,   // a vertex of b and a face of a
  kVertexA = 2,   // a vertex of a and a face of b
  kCrossing = 3,  // where edges of two faces cross, seen along the normal
};
constexpr std::uint32_t make_feature(Touch touch, std::uint32_t a, std::uint32_t b) {
  return static_cast<std::uint32_t>(touch) << 30 | (a & 0x7fff) << 15 | (b & 0x7fff);
}
constexpr Touch touch_of(std::uint32_t feature) { return static_cast<Touch>(feature >> 30); }

// A face of a convex shape: a planar convex polygon, counter-clockwise seen from outside.
template <typename Scalar>
struct Face {
  Face() = default;
  // There is room for far more corners than most faces have.
  Face(const Face& other) { *this = other; }
  Face& operator=(const Face& other) {
    normal = other.normal;
    id = other.id;
    count = other.count;
    std::copy_n(other.vertex, count, vertex);
    std::copy_n(other.vertex_id, count, vertex_id);
    return *this;
  }

  Vector3<Scalar> normal;  // unit length, pointing out
  int id;                  // of the face; for features
  int count;               // of vertices, at least 3
  Vector3<Scalar> vertex[kFaceVerticesMax];
  std::uint16_t vertex_id[kFaceVerticesMax];  // for features
};

// The face whose normal is closest to a direction (of any length), in the frame of the shape. Of a triangle,
// the front or the back.
template <typename Scalar>
Face<Scalar> supporting_face(const Box<Scalar>& box, const Vector3<Scalar>& direction);
template <typename Scalar>
Face<Scalar> supporting_face(const Polyhedron<Scalar>& polyhedron, const Vector3<Scalar>& direction);
template <typename Scalar>
Face<Scalar> supporting_face(const MeshTriangle<Scalar>& triangle, const Vector3<Scalar>& direction);

// A face in other axes: x -> rotation x + offset.
template <typename Scalar>
Face<Scalar> placed(const Face<Scalar>& face, const Matrix3<Scalar>& rotation, const Vector3<Scalar>& offset);

// The contact of two faces that are opposite each other along `normal` (unit length, from b to a): at most
// four points of where they cover each other, seen along the normal, with gaps up to `margin` (m). Both faces
// and the normal are in the same axes, relative to the centre of a. No points if they do not cover each
// other.
template <typename Scalar>
Manifold<Scalar> clip_faces(const Face<Scalar>& a, const Face<Scalar>& b, const Vector3<Scalar>& normal,
                            std::type_identity_t<Scalar> margin);

// Fills a manifold, whose normal is set, with the four of the points that matter most: the deepest, the
// farthest from it, then those that add the most area. If four or more overlap, only those count. A function
// of the points alone: neither their order nor history matters.
template <typename Scalar>
void reduce(std::span<const ContactPoint<Scalar>> points, Manifold<Scalar>& manifold);

}  // namespace tessera::collision
