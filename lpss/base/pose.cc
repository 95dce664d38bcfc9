#include "lpss/base/pose.h"

namespace tessera {

Pose Pose::operator*(const Pose& child) const {
  return {position + orientation * child.position, orientation * child.orientation};
}

Pose Pose::inverse() const {
  const Eigen::Quaterniond back = orientation.conjugate();
  return {back * -position, back};
}

bool Pose::is_identity() const {
  return position == Eigen::Vector3d::Zero() && orientation.coeffs() == Eigen::Vector4d(0, 0, 0, 1);
}

}  // namespace tessera
