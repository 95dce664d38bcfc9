// How near two shapes come to each other, in double precision.
#pragma once

#include <absl/status/status.h>

#include <Eigen/Core>
#include <optional>

#include "lpss/model/shape.h"

namespace tessera {

// The larger of two surfaces has at most so many triangles.
inline constexpr std::size_t kDistanceTrianglesMax = 100'000;

struct PosedShape {
  const Shape& shape;
  Pose pose;  // of the body frame, relative to one origin near both shapes
};

struct ShapeDistance {
  double gap = 0;  // m; < 0 where convex parts overlap: by which they would have to move along the normal
  Eigen::Vector3d on_a = Eigen::Vector3d::Zero();  // on the surfaces, relative to the origin
  Eigen::Vector3d on_b = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // of unit length, from b to a
};

// INVALID_ARGUMENT for pairs of parts of which none is convex (planes, meshes, height fields), for ground,
// and for surfaces of more triangles than that.
absl::Status check_distance(const Shape& a, const Shape& b);

// Over all pairs of parts, that of the smallest gap, of several the first one; nothing if it is larger than
// `reach` (m). Meshes and height fields have no inside. The shapes have passed check_distance().
std::optional<ShapeDistance> distance_of(const PosedShape& a, const PosedShape& b, double reach);

}  // namespace tessera
