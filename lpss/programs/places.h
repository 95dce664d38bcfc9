// Places on the body of a program.
#pragma once

#include <Eigen/Core>

#include "lpss/programs/program.h"

namespace tessera {

// From the centre of mass to a point of the body frame (m), along the world's axes, for a body that is turned
// so.
inline Eigen::Vector3d lever_of(const Senses& senses, const Eigen::Quaterniond& turn,
                                const Eigen::Vector3d& point) {
  return turn * (point - centre_frame(senses.properties).position);
}

}  // namespace tessera
