// The scenes of the paper's figures, around the centre of the anchor's sector.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lpss/model/body.h"
#include "lpss/model/world_description.h"

namespace tessera {

// Two balls of 0.5 m radius that fly at each other at 5 m/s each and graze. They meet between two ticks: a
// pair that meets exactly on one is decided by the last digit of its place (by 0.157 m, where that was
// measured).
WorldDescription collision_scene(const WorldSettings& settings);

// Moves all bodies, and all joints to the world, such that what is at the centre of sector (0, 0, 0) comes to
// `place`, whose local part may be beyond its sector. The anchor stays. Errors as canonical().
absl::Status move_to(WorldDescription& world, const WorldPosition& place);

// Of all bodies of `records`, in their order: metres from `origin`.
std::vector<Eigen::Vector3d> positions_from(const WorldPosition& origin,
                                            const std::vector<BodyRecord>& records, double sector_size);

// The largest distance (m) of two bodies in the same place of both; infinite where one is no number.
double largest_distance(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b);

}  // namespace tessera
