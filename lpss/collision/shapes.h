// Convex shapes, and triangles of meshes, for the narrow phase. Lengths in metres, in the frame of the shape.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace tessera::collision {

template <typename Scalar>
using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
template <typename Scalar>
using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;

// Where two shapes are, relative to each other: no large coordinate is needed, so no digit is lost.
template <typename Scalar>
struct Placement {
  Matrix3<Scalar> a;       // rotation, from the frame of a to world axes
  Matrix3<Scalar> b;       // likewise
  Vector3<Scalar> offset;  // m, the centre of b minus that of a, world axes

  Placement swapped() const { return {b, a, -offset}; }
};

template <typename Scalar>
struct Ball {
  Scalar radius;
};

// All points within `radius` of a segment on the z axis, from -half_length to half_length.
template <typename Scalar>
struct Capsule {
  Scalar radius;
  Scalar half_length;
};

template <typename Scalar>
struct Box {
  Vector3<Scalar> half;  // half the edge lengths
};

// The half space normal . x <= offset.
template <typename Scalar>
struct HalfSpace {
  Vector3<Scalar> normal;  // unit length
  Scalar offset;
};

// The corners of a face, as a range of a list of vertex indices, counter-clockwise seen from outside.
struct FaceLoop {
  std::uint16_t first;
  std::uint16_t count;
};

struct HullEdge {
  std::uint16_t tail;  // vertices
  std::uint16_t head;
  std::uint16_t left;  // faces: `left` has the edge from tail to head in its loop, `right` from head to tail
  std::uint16_t right;
};

inline constexpr int kFaceVerticesMax = 128;
inline constexpr int kHullVerticesMax = 1024;
inline constexpr int kHullFacesMax = 2 * kHullVerticesMax;  // as Euler's formula has it
inline constexpr int kHullEdgesMax = 3 * kHullVerticesMax;

// A convex polyhedron. Faces are planar, and no two neighbours are in the same plane. The origin should be
// inside.
template <typename Scalar>
struct Polyhedron {
  std::vector<Vector3<Scalar>> vertices;
  std::vector<HalfSpace<Scalar>> planes;  // one a face
  std::vector<FaceLoop> faces;
  std::vector<std::uint16_t> corners;  // what the loops of the faces are ranges of
  std::vector<HullEdge> edges;
  Scalar thickness;  // m, half the least width along a normal of a face
};

// Builds a polyhedron from the faces of a convex hull: `loops` lists vertices of each face counter-clockwise
// seen from outside. Neighbouring faces merge where all vertices of both are within `tolerance` times the
// largest extent of a common plane; vertices that no corner needs are dropped. Returns nothing if the faces
// do not close a convex polyhedron, or if a limit above is exceeded.
template <typename Scalar>
std::optional<Polyhedron<Scalar>> make_polyhedron(std::span<const Vector3<Scalar>> vertices,
                                                  std::span<const std::vector<int>> loops,
                                                  double tolerance = 1e-5);

// The side of a surface on which a shape is kept: that of its centre, or the one given, wherever its centre
// is.
enum class KeptOn : std::uint8_t { kSideOfCentre, kFront, kBack };

// A triangle of a surface, in the frame of the surface. What touches an edge that two triangles share must
// not meet it as if the neighbour were absent: at such an edge, normals of contacts lie between the normals
// of the two triangles; at a flat or concave edge they are normal to the triangle.
template <typename Scalar>
struct MeshTriangle {
  Vector3<Scalar> vertex[3];  // counter-clockwise seen from the front
  Vector3<Scalar> normal;     // unit length, to the front
  // Of the triangles across the edges; edge k goes from vertex k to k + 1.
  Vector3<Scalar> neighbour_normal[3];
  bool has_neighbour[3];
  // Where shapes are kept. By themselves, both sides are alike.
  KeptOn kept_on = KeptOn::kSideOfCentre;
};

// A triangle without neighbours. Its area must not be 0.
template <typename Scalar>
MeshTriangle<Scalar> make_triangle(const Vector3<Scalar>& v0, const Vector3<Scalar>& v1,
                                   const Vector3<Scalar>& v2);

// Declares that the triangle across `edge` has its third vertex at `opposite`; its own winding does not
// matter.
template <typename Scalar>
void set_neighbour(MeshTriangle<Scalar>& triangle, int edge, const Vector3<Scalar>& opposite);

}  // namespace tessera::collision
