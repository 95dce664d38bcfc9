// Cuts large static shapes to what one sector needs of them, so that every number in it stays small.
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "lpss/ground/tile_store.h"
#include "lpss/model/shape.h"
#include "lpss/partition/mesh_tree.h"

namespace tessera {

// What of `geometry` reaches into `region` (m, sector frame), for a geometry posed by `pose` in the same
// frame. Its own pose is near the region, however far away the geometry's origin is: planes and
// boxes are moved and clipped, meshes and height fields keep the triangles and cells that overlap. Where a
// clipped box ends inside, it ends outside of the region. Nothing where the two do not meet. Other geometries
// come back whole; of ground, cut_ground_to() has to do it. `tree` is that of the geometry, if that is a
// mesh, and is not looked at otherwise.
std::optional<ShapePart> cut_to(const Geometry& geometry, const Pose& pose, const Eigen::AlignedBox3d& region,
                                const MeshTree* tree);

// The triangles of a ground that overlap `region`, likewise; waits for tiles that are not there yet. They
// have the same names and the same order in whatever region they are.
std::optional<ShapePart> cut_ground_to(TileStore& store, const TileStore::Source& ground, const Pose& pose,
                                       const Eigen::AlignedBox3d& region);

// Has the tiles made soon that this will need.
void ask_for_ground(TileStore& store, const TileStore::SourceRef& ground, const Pose& pose,
                    const Eigen::AlignedBox3d& region);

// Whether there may be any triangle in it. Needs no tile.
bool may_have_ground(const TileStore::Source& ground, const Pose& pose, const Eigen::AlignedBox3d& region);

}  // namespace tessera
