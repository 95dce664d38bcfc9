// Conversion between the numbers of the engine interface (doubles, Eigen) and Bullet's (btScalar).
//
// A double from Bullet converts back without rounding, whatever btScalar is.
#pragma once

#include <LinearMath/btTransform.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

#include "lpss/grid/world_position.h"

namespace tessera::bullet {

inline btVector3 to_bullet(const std::array<double, 3>& v) {
  return {btScalar(v[0]), btScalar(v[1]), btScalar(v[2])};
}

inline btVector3 to_bullet(const Eigen::Vector3d& v) {
  return {btScalar(v.x()), btScalar(v.y()), btScalar(v.z())};
}

inline btTransform to_bullet(const Pose& pose) {
  // The matrix is computed in double precision, so that only the end result is rounded.
  const Eigen::Matrix3d m = pose.orientation.normalized().toRotationMatrix();
  const btMatrix3x3 basis(btScalar(m(0, 0)), btScalar(m(0, 1)), btScalar(m(0, 2)), btScalar(m(1, 0)),
                          btScalar(m(1, 1)), btScalar(m(1, 2)), btScalar(m(2, 0)), btScalar(m(2, 1)),
                          btScalar(m(2, 2)));
  return btTransform(basis, to_bullet(pose.position));
}

inline btMatrix3x3 to_bullet(const std::array<double, 9>& rows) {
  return {btScalar(rows[0]), btScalar(rows[1]), btScalar(rows[2]), btScalar(rows[3]), btScalar(rows[4]),
          btScalar(rows[5]), btScalar(rows[6]), btScalar(rows[7]), btScalar(rows[8])};
}

inline std::array<double, 3> to_array(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

inline std::array<double, 9> to_array(const btMatrix3x3& m) {
  return {m[0].x(), m[0].y(), m[0].z(), m[1].x(), m[1].y(), m[1].z(), m[2].x(), m[2].y(), m[2].z()};
}

inline Eigen::Vector3d to_eigen(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

inline Eigen::Matrix3d to_eigen(const btMatrix3x3& m) {
  Eigen::Matrix3d result;
  for (int row = 0; row < 3; ++row) result.row(row) = to_eigen(m[row]);
  return result;
}

}  // namespace tessera::bullet
