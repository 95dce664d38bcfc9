#include "lpss/base/rotation.h"

#include <cmath>

#include "lpss/base/portable_math.h"

namespace tessera {

Eigen::Quaterniond rotation_by(const Eigen::Vector3d& turn) {
  const double angle = turn.norm();
  const portable::SinCos half = portable::sincos(angle / 2);
  // Squares of vectors too short for a norm vanish.
  const double scale = angle > 0 ? half.sin / angle : 0.5;
  Eigen::Quaterniond rotation;
  rotation.vec() = turn * scale;
  rotation.w() = half.cos;
  return rotation;
}

Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& rotation) {
  const double sine = rotation.vec().norm();
  const double angle = 2 * portable::atan2(sine, std::abs(rotation.w()));
  const double scale = sine > 0 ? angle / sine : 2;
  return rotation.vec() * (rotation.w() < 0 ? -scale : scale);
}

double rotation_angle(const Eigen::Quaterniond& rotation) {
  return 2 * portable::atan2(rotation.vec().norm(), std::abs(rotation.w()));
}

}  // namespace tessera
