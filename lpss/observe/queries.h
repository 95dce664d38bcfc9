// Questions about any number of sectors: each is asked near its own centre. Between ticks. Sectors at rest
// that are packed come back when they are asked.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "lpss/partition/partition.h"

namespace tessera {

struct RayAnswer {
  BodyId body;
  double distance = 0;  // m, from the origin of the ray
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
};

// The nearest hit of a ray (`length` in m, `direction` of unit length) in the sectors of this partition.
// Static bodies count in the sectors that the ray passes through, up to where it has passed through
// kRayGroundSectorsMax sectors of which the ground may reach up to it. A solid shape is hit where the ray
// enters it, not where it begins inside; planes, meshes and height fields are hit from both sides.
std::optional<RayAnswer> raycast(Partition& partition, const WorldPosition& origin,
                                 const Eigen::Vector3d& direction, double length, std::uint32_t mask);

// The bodies of this partition's sectors, and statics in them, within `reach` (m) of a convex `probe` at
// `pose`, in ascending order of (distance, id). A static body may be found by several servers; the smallest
// distance counts.
std::vector<NearBody> bodies_near(Partition& partition, const Geometry& probe, const WorldPose& pose,
                                  double reach, std::uint32_t mask);

}  // namespace tessera
