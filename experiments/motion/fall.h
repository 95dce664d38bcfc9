// Falling around a planet, integrated finely: what the engine's orbits are compared with.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "lpss/model/settings.h"

namespace tessera {

// All vectors are along the axes of the world.
struct FallingPoint {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();     // m, from the centre of the planet
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // m/s
};

// A part of what falls together.
struct FallingMass {
  double share = 0;                                       // of the whole mass
  Eigen::Vector3d from_centre = Eigen::Vector3d::Zero();  // m, from the common centre of mass
};

// A point `seconds` (of any sign) later, in steps of at most a second. What accelerates it is the mean pull
// on `parts`, which stay where they are around it; on the point itself if there are none.
FallingPoint fallen(const CentralGravity& planet, const FallingPoint& point, double seconds,
                    std::span<const FallingMass> parts = {});

// Likewise one that is near another one, both of which fall: relative to that.
FallingPoint fallen_beside(const CentralGravity& planet, const FallingPoint& point,
                           const FallingPoint& beside, double seconds);

// N m for each kg of all, about their common centre of mass, which is at `place`.
Eigen::Vector3d torque_on(const CentralGravity& planet, const Eigen::Vector3d& place,
                          std::span<const FallingMass> parts);

}  // namespace tessera
