// Concave outlines and meshes as convex parts.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "worlds/loader/mesh_file.h"

namespace tessera {

using Outline = std::vector<Eigen::Vector2d>;  // in either direction, without the first point again

// Twice the area that an outline surrounds, > 0 if counter-clockwise.
double double_area(const Outline& outline);

// Triangles that cover the area of a simple outline, counter-clockwise, as indices of its points.
// INVALID_ARGUMENT if it crosses itself.
absl::StatusOr<std::vector<std::uint32_t>> triangles_of(const Outline& outline);

// The same area as convex outlines of its points, counter-clockwise; few, if not as few as possible.
absl::StatusOr<std::vector<Outline>> convex_parts(const Outline& outline);

// Whether all points of a mesh object are within 1 % of its size behind each of its triangles. Of objects
// for which that would take too long, they are taken not to be.
bool is_convex(const SubMesh& object);

inline constexpr std::size_t kDividedTrianglesMax = 2048;     // of an object to be divided: some seconds
inline constexpr std::size_t kDividedTrianglesInAll = 32768;  // of all objects of a world: a minute
inline constexpr std::size_t kPartsMax = 64;                  // of an object

// Divides an object by HACD into at most so many groups of triangles, whose hulls follow its surface within
// 1 % of its size where that number suffices. By its points; none if it has more than kDividedTrianglesMax
// triangles, these are not connected by edges, or edges have so many of them that this is no surface: HACD
// looks at all pairs that share one.
//
// Depends on the mesh alone: HACD computes with sums, products and square roots in double precision, in one
// thread and in the order of the triangles. What is left of the C library, pow(), is for a weight of 0.
std::optional<std::vector<std::vector<Eigen::Vector3d>>> divided(const SubMesh& object,
                                                                 std::size_t parts_max);

}  // namespace tessera
