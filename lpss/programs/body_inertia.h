// The inertia of the body of a program.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "lpss/model/body.h"

namespace tessera {

// kg m^2, about the centre of mass, along the axes of the body frame.
inline Eigen::Matrix3d body_inertia(const BodyProperties& properties) {
  const Eigen::Matrix3d axes = centre_frame(properties).orientation.toRotationMatrix();
  return axes * Eigen::Vector3d(properties.inertia.data()).asDiagonal() * axes.transpose();
}

}  // namespace tessera
