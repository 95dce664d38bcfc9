#include "lpss/base/torque_free.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "lpss/base/portable_math.h"
#include "lpss/base/rotation.h"

namespace tessera {
namespace {

constexpr double kTurnMax = 0.125;  // rad, about a principal axis in one step
constexpr double kStepsMax = 1024;

// Of steps with a constant rate.
constexpr double kStepTurnMax = 0.7;  // rad
constexpr double kLittle = 0.05;      // rad, in half a step: one iteration will do
constexpr int kIterations = 3;        // more, where it turns farther

// A body's axes, and its angular momentum in their frame.
struct Turning {
  Eigen::Matrix3d axes;
  Eigen::Vector3d momentum;
};

portable::SinCos sincos(double angle) {
  if (!(std::abs(angle) <= kTurnMax)) return portable::sincos(angle);
  // The tangent of half the angle as p / q, to 1e-10 of it: an exact rotation by almost that angle.
  const double half = angle / 2;
  const double p = half * (15 - half * half);
  const double q = 15 - 6 * half * half;
  const double scale = 1 / (q * q + p * p);
  return {2 * p * q * scale, (q * q - p * p) * scale};
}

// Turns the body about one of its axes. Its momentum stays where it is in the world.
void turn(Turning& motion, Eigen::Index axis, double angle) {
  const portable::SinCos by = sincos(angle);
  const Eigen::Index u = (axis + 1) % 3;
  const Eigen::Index v = (axis + 2) % 3;
  const auto mix = [&](auto&& x, auto&& y) {
    const auto before = x.eval();
    x = before * by.cos + y * by.sin;
    y = y * by.cos - before * by.sin;
  };
  mix(motion.axes.col(u), motion.axes.col(v));
  mix(motion.momentum.segment<1>(u), motion.momentum.segment<1>(v));
}

// What a rotation vector within half of kStepTurnMax changes of a vector: to 1e-9 of it, and in fewer
// instructions than with a sine.
Eigen::Vector3d change_by(const Eigen::Vector3d& turn, const Eigen::Vector3d& vector) {
  const double square = turn.squaredNorm();
  const double sine = 1 - square / 6 * (1 - square / 20 * (1 - square / 42));        // by the angle
  const double versine = 0.5 - square / 24 * (1 - square / 30 * (1 - square / 56));  // by its square
  const Eigen::Vector3d across = turn.cross(vector);
  return sine * across + versine * turn.cross(across);
}

double half_step(const Eigen::Vector3d& rate, double dt) {
  const double square = rate.squaredNorm();
  return (square * dt * dt <= kStepTurnMax * kStepTurnMax ? dt : kStepTurnMax / std::sqrt(square)) / 2;
}

}  // namespace

Spin torque_free(const Spin& spin, const Eigen::Vector3d& moments, double dt) {
  Eigen::Index low = 0;
  Eigen::Index middle = 1;
  Eigen::Index high = 2;
  if (moments[low] > moments[middle]) std::swap(low, middle);
  if (moments[middle] > moments[high]) std::swap(middle, high);
  if (moments[low] > moments[middle]) std::swap(low, middle);
  // rad about an axis in the time, by the momentum about it: beyond what the middle moment gives.
  const double low_rate = (1 / moments[low] - 1 / moments[middle]) * dt;
  const double high_rate = (1 / moments[high] - 1 / moments[middle]) * dt;

  Turning motion{spin.axes, moments.cwiseProduct(spin.axes.transpose() * spin.rate)};
  const Eigen::Vector3d momentum = spin.axes * motion.momentum;
  double steps = 1;
  if (low_rate != 0 && high_rate != 0) {
    const double most = motion.momentum.norm() * std::max(low_rate, -high_rate);
    if (most > kTurnMax) steps = std::min(std::ceil(most / kTurnMax), kStepsMax);
  }
  const auto turn_low = [&](double share) { turn(motion, low, motion.momentum[low] * low_rate * share); };
  const auto turn_high = [&](double share) { turn(motion, high, motion.momentum[high] * high_rate * share); };
  const double share = 1 / steps;
  turn_low(share / 2);
  for (double step = 1; step < steps; ++step) {
    turn_high(share);
    turn_low(share);
  }
  turn_high(share);
  turn_low(share / 2);

  const Eigen::Matrix3d about_momentum = rotation_by(momentum * (dt / moments[middle])).toRotationMatrix();
  const Eigen::Matrix3d axes = about_momentum * motion.axes;
  return {axes, axes * motion.momentum.cwiseQuotient(moments)};
}

Eigen::Vector3d momentum_beyond_middle(const Eigen::Matrix3d& inertia, const Eigen::Vector3d& rate,
                                       const Eigen::Vector3d& turning, double dt) {
  return -change_by(turning * half_step(turning, dt), inertia * rate);
}

SteppedRate next_rate(const Eigen::Matrix3d& inertia, const Eigen::Matrix3d& inverse_inertia,
                      const Eigen::Vector3d& last, double dt) {
  const Eigen::Vector3d momentum = inertia * last;
  const double half = half_step(last, dt);
  const Eigen::Vector3d middle = momentum + change_by(last * -half, momentum);
  Eigen::Vector3d beyond = change_by(last * -half, middle);
  Eigen::Vector3d rate = inverse_inertia * (middle + beyond);
  if (last.squaredNorm() * half * half < kLittle * kLittle) return {rate, beyond};
  for (int n = 0; n < kIterations; ++n) {
    beyond = change_by(rate * -half, middle);
    rate = inverse_inertia * (middle + beyond);
  }
  rate *= std::sqrt(last.dot(momentum) / rate.dot(middle + beyond));
  return {rate, momentum_beyond_middle(inertia, rate, rate, dt)};
}

SteppedRate next_rate_of_rotor(const Eigen::Matrix3d& inertia, const Eigen::Vector3d& axis,
                               const Eigen::Vector3d& last, double dt) {
  const Eigen::Vector3d momentum = inertia * last;
  const Eigen::Vector3d last_tilt = last - axis * axis.dot(last);
  const double half = half_step(last_tilt, dt);
  const Eigen::Vector3d middle = momentum + change_by(last_tilt * -half, momentum);
  // With the moments I and J across the axis and about it, and the angle x of the tilt, the momentum in the
  // middle of the step is I tilt + J spin exp(tilt dt / 2) axis, of which
  //   J spin cos(x / 2)                             is along the axis,
  //   I tilt + J spin sin(x / 2) dt / x tilt x axis across it.
  const double about = axis.dot(inertia * axis);
  const double across = (inertia.trace() - about) / 2;
  const double square = half * half * last_tilt.squaredNorm();  // (x / 2)^2, which stays
  const double along = axis.dot(middle);
  const double tangent = 1 + square / 3 * (1 + square * (2. / 5) * (1 + square * (17. / 42)));  // by x / 2
  const double gyroscopic = along * half * tangent;
  const Eigen::Vector3d rest = middle - along * axis;
  const Eigen::Vector3d tilt =
      (across * rest - gyroscopic * rest.cross(axis)) / (across * across + gyroscopic * gyroscopic);
  const double cosine = 1 - square / 2 * (1 - square / 12 * (1 - square / 30));
  const Eigen::Vector3d rate = tilt + axis * (along / (about * cosine));
  return {rate, momentum_beyond_middle(inertia, rate, tilt, dt)};
}

}  // namespace tessera
