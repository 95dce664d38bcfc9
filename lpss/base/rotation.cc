#include "lpss/base/rotation.h"

#include <cmath>

#include "lpss/base/portable_math.h"

namespace tessera {
namespace {

// Up to here the series below are as good as correctly rounded: the terms that are left out come to less than
// 1e-17.
constexpr double kSmallHalfAngleSquared = 1.0 / 256;

// sin(x) / x, from x squared.
double small_sinc(double squared) {
  return 1 + squared * (-1. / 6 + squared * (1. / 120 + squared * (-1. / 5040 + squared * (1. / 362880))));
}

// Likewise.
double small_cos(double squared) {
  return 1 + squared * (-1. / 2 + squared * (1. / 24 + squared * (-1. / 720 + squared * (1. / 40320))));
}

}  // namespace

Eigen::Quaterniond rotation_by(const Eigen::Vector3d& turn) {
  // Nearly all turns are those of a step.
  const double half_angle_squared = turn.squaredNorm() / 4;
  if (half_angle_squared < kSmallHalfAngleSquared) {
    Eigen::Quaterniond rotation;
    rotation.vec() = turn * (small_sinc(half_angle_squared) / 2);
    rotation.w() = small_cos(half_angle_squared);
    return rotation;
  }
  const double angle = turn.norm();
  const portable::SinCos half = portable::sincos(angle / 2);
  const double scale = half.sin / angle;
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
