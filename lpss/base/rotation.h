// Rotation vectors: the axis of a rotation times its angle in rad. For use in place of Eigen's AngleAxis,
// which calls the C library: its last bits depend on the processor.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace tessera {

// The unit quaternion of a rotation vector of any length.
Eigen::Quaterniond rotation_by(const Eigen::Vector3d& turn);

// The rotation vector of a unit quaternion; no longer than pi.
Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& rotation);

// The angle of a unit quaternion: rad, 0 to pi.
double rotation_angle(const Eigen::Quaterniond& rotation);

// The axes of a body (columns of a rotation matrix) after a rotation vector in the same frame. The matrix of
// the turn is computed in double precision; only it and the product are rounded to Scalar.
template <typename Scalar>
Eigen::Matrix<Scalar, 3, 3> turned(const Eigen::Matrix<Scalar, 3, 3>& axes, const Eigen::Vector3d& turn) {
  return rotation_by(turn).toRotationMatrix().cast<Scalar>() * axes;
}

// The tensor with these principal values along the axes of a body (columns of a rotation matrix). In double
// precision whatever the engine computes with: a tensor that is rounded to single precision is not symmetric,
// and an elongated body would have negative mobilities (down to -6e-8 of the largest).
template <typename Scalar>
Eigen::Matrix3d tensor_along(const Eigen::Matrix<Scalar, 3, 3>& axes,
                             const Eigen::Matrix<Scalar, 3, 1>& principal) {
  const Eigen::Matrix3d exact = axes.template cast<double>();
  return exact * principal.template cast<double>().asDiagonal() * exact.transpose();
}

}  // namespace tessera
