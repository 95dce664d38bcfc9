// Cuts the part out of a large static shape that one sector needs, so that every number in it stays small.
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "lpss/model/shape.h"
#include "lpss/partition/mesh_tree.h"

namespace tessera {

// The part of `geometry` that reaches into `region` (m, sector frame), for a geometry posed by `pose` in the
// same frame. The part's own pose is near the region, however far away the geometry's origin is: planes and
// boxes are moved and clipped, meshes and height fields keep the triangles and cells that overlap. Where a
// clipped box ends inside, it ends outside of the region. Nothing where the two do not meet. Other geometries
// come back whole. `tree` is that of the geometry, if that is a mesh, and is not looked at otherwise.
std::optional<ShapePart> part_within(const Geometry& geometry, const Pose& pose,
                                     const Eigen::AlignedBox3d& region, const MeshTree* tree);

}  // namespace tessera
