// Cuts the part out of a large static shape that one sector needs, so that every number in it stays small.
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "lpss/ground/tile_store.h"
#include "lpss/model/shape.h"
#include "lpss/partition/mesh_tree.h"

namespace tessera {

// The part of `geometry` that reaches into `region` (m, sector frame), for a geometry posed by `pose` in the
// same frame. The part's own pose is near the region, however far away the geometry's origin is: planes and
// boxes are moved and clipped, meshes and height fields keep the triangles and cells that overlap. Where a
// clipped box ends inside, it ends outside of the region. Nothing where the two do not meet. Other geometries
// come back whole; of ground, ground_within() makes the part. `tree` is that of the geometry, if that is a
// mesh, and is not looked at otherwise.
std::optional<ShapePart> part_within(const Geometry& geometry, const Pose& pose,
                                     const Eigen::AlignedBox3d& region, const MeshTree* tree);

// The triangles of a ground that overlap `region`, likewise; waits for tiles that are not there yet. They
// have the same names and the same order in whatever region they are.
std::optional<ShapePart> ground_within(TileStore& store, const TileStore::Source& ground, const Pose& pose,
                                       const Eigen::AlignedBox3d& region);

// Has the tiles of that part made soon.
void ask_for_ground(TileStore& store, const TileStore::SourceRef& ground, const Pose& pose,
                    const Eigen::AlignedBox3d& region);

// Whether there may be any triangle in it. Needs no tile.
bool may_have_ground(const TileStore::Source& ground, const Pose& pose, const Eigen::AlignedBox3d& region);

}  // namespace tessera
