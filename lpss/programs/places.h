// Places on the body of a program.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>

#include "lpss/base/portable_math.h"
#include "lpss/programs/numbers.h"
#include "lpss/programs/program.h"

namespace tessera {

// From the centre of mass to a point of the body frame (m), along the world's axes, for a body that is turned
// so.
inline Eigen::Vector3d lever_of(const Senses& senses, const Eigen::Quaterniond& turn,
                                const Eigen::Vector3d& point) {
  return turn * (point - centre_frame(senses.properties).position);
}

// A rotation by three angles (rad), as SDF and URDF have them: about x, then about y, then about z, of axes
// that stay.
inline Eigen::Quaterniond turned_by(double roll, double pitch, double yaw) {
  const auto about = [](const Eigen::Vector3d& axis, double angle) {
    const auto [sin, cos] = portable::sincos(angle / 2);
    return Eigen::Quaterniond(cos, sin * axis.x(), sin * axis.y(), sin * axis.z());
  };
  return about(Eigen::Vector3d::UnitZ(), yaw) * about(Eigen::Vector3d::UnitY(), pitch) *
         about(Eigen::Vector3d::UnitX(), roll);
}

// How a sensor is turned in its frame: by three parameters, from `roll` on.
template <typename Place>
Eigen::Quaterniond mounting(const Senses& senses, Place roll) {
  const double* const angles = &at(senses.parameters, roll);
  return turned_by(angles[0], angles[1], angles[2]);
}

}  // namespace tessera
