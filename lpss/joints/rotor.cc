#include "lpss/joints/rotor.h"

#include <algorithm>
#include <cmath>

namespace tessera::joints {
namespace {

// By how much two moments may differ, and an axis be off from another or from the centre of mass, as a share
// of what it is compared with: links of models have such errors. What they shake is lost.
constexpr double kOff = 1e-3;

// About an axis through the centre of mass, in the body frame, of which the other moments are alike.
bool is_symmetric(const Eigen::Vector3d& axis, const Eigen::Vector3d& moments_inverse) {
  const Eigen::Vector3d response = moments_inverse.cwiseProduct(axis);
  const double about = axis.dot(response);
  const double across = (moments_inverse.sum() - about) / 2;
  if ((response - about * axis).norm() > kOff * std::min(about, across)) return false;
  // Squares of the two moments across: their sum and their product follow from those of all three.
  const double squares = moments_inverse.squaredNorm() - about * about;
  const double difference_squared = 2 * squares - 4 * across * across;
  return difference_squared <= kOff * kOff * across * across;
}

// The thread of a screw is known by the angle of its child.
bool may_leave_free(JointType type, bool is_child) {
  return type == JointType::kRevolute || (type == JointType::kScrew && is_child);
}

}  // namespace

void RotorSearch::add(JointType type, bool is_child, const Pose& in_body, double inverse_mass,
                      const Eigen::Vector3d& moments_inverse) {
  if (is_none_) return;
  const auto leaves_free = [&](const Eigen::Vector3d& axis) {
    if (axis_ && axis.cross(*axis_).norm() > kOff) return false;
    const double radius_squared = inverse_mass * moments_inverse.cwiseInverse().maxCoeff();
    return in_body.position.cross(axis).squaredNorm() <= kOff * kOff * radius_squared &&
           is_symmetric(axis, moments_inverse);
  };
  if (may_leave_free(type, is_child)) {
    const Eigen::Vector3d axis = in_body.orientation * Eigen::Vector3d::UnitX();
    is_none_ = !leaves_free(axis);
    if (!axis_) axis_ = axis;
  } else {
    is_none_ = true;
  }
  if (is_none_) axis_.reset();
}

}  // namespace tessera::joints
