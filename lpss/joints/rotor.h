// Wheels, propellers, screws, flywheels: bodies that joints let turn about an axis of symmetry. However fast
// such a body does so, neither its inertia nor what its joints hold changes by it, so that it takes no
// shorter steps. Only what tilts the axis does.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "lpss/joints/joint_form.h"

namespace tessera::joints {

// Looks at all joints of a body, and finds its axis, if it has one.
class RotorSearch {
 public:
  // `moments_inverse` are those about the axes of the body frame, 1/(kg m^2); `in_body` is the frame of the
  // joint there.
  void add(JointType type, bool is_child, const Pose& in_body, double inverse_mass,
           const Eigen::Vector3d& moments_inverse);

  // Of unit length, in the body frame.
  const std::optional<Eigen::Vector3d>& axis() const { return axis_; }

 private:
  std::optional<Eigen::Vector3d> axis_;
  bool is_none_ = false;
};

// The angular velocity of a rotor without what turns it about its axis. World axes.
inline Eigen::Vector3d tilt_rate(const Eigen::Vector3d& axis, const Eigen::Vector3d& rate) {
  return rate - axis * axis.dot(rate);
}

}  // namespace tessera::joints
