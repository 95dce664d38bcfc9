#include "lpss/native/carrier.h"

#include "lpss/base/rotation.h"

namespace tessera::native {
namespace {

// The way of a point at `arm` from the centre of a rotation. From the parts of the quaternion: in the place
// of a difference of two places, which would lose digits.
Eigen::Vector3d way_of(const Eigen::Quaterniond& turn, const Eigen::Vector3d& arm) {
  const Eigen::Vector3d across = turn.vec().cross(arm);
  return 2 * (turn.w() * across + turn.vec().cross(across));
}

}  // namespace

bool rides_on(const Body& carrier, const Body& rider) {
  constexpr Scalar kAlike = Scalar(0.2);  // of the carrier's rate
  const Scalar apart = (rider.angular - carrier.angular_before).squaredNorm();
  return apart <= kAlike * kAlike * carrier.angular_before.squaredNorm();
}

SolverTypes<Scalar>::Course course_at(const Body& body, const Vector& arm_of_rider, const Vector& lever,
                                      bool is_ridden, double dt) {
  const Eigen::Vector3d arm = arm_of_rider.cast<double>();
  const Eigen::Vector3d spin = body.angular.cast<double>();
  const Eigen::Vector3d spin_before = body.angular_before.cast<double>();
  const Eigen::Vector3d linear_before = body.linear_before.cast<double>();
  const Eigen::Vector3d linear = body.linear.cast<double>();
  const auto velocity = [&](const Eigen::Vector3d& rate, double time) -> Eigen::Vector3d {
    return is_ridden ? Eigen::Vector3d(way_of(rotation_by(rate * time), arm) / time) : rate.cross(arm);
  };
  const Eigen::Vector3d start = linear_before + velocity(spin_before, -dt);
  const Eigen::Vector3d end = linear + velocity(spin, dt);
  const Eigen::Vector3d by_velocities = linear + spin.cross(lever.cast<double>());
  return {.linear = (start - by_velocities).cast<Scalar>(),
          .angular = (spin_before - spin).cast<Scalar>(),
          .linear_change = (end - start).cast<Scalar>(),
          .angular_change = (spin - spin_before).cast<Scalar>()};
}

Vector turned_with(const Body& body, const Vector& impulse, double dt) {
  if (body.angular.isZero(0)) return impulse;
  return (rotation_by(body.angular.cast<double>() * dt) * impulse.cast<double>()).cast<Scalar>();
}

}  // namespace tessera::native
