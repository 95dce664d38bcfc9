#include "experiments/motion/fall.h"

#include <cmath>
#include <functional>

#include "lpss/model/gravity.h"

namespace tessera {
namespace {

using Eigen::Vector3d;

// A point that falls, and what falls beside it, relative to it.
using FallState = Eigen::Matrix<double, 3, 4>;  // place, velocity, place beside, velocity beside
using FallRate = std::function<FallState(const FallState&)>;

FallState integrated(const FallState& start, double seconds, const FallRate& rate) {
  const auto steps = static_cast<long>(std::ceil(std::abs(seconds)));
  const double h = steps > 0 ? seconds / static_cast<double>(steps) : 0;
  FallState now = start;
  for (long n = 0; n < steps; ++n) {
    const FallState a = rate(now);
    const FallState b = rate(now + a * (h / 2));
    const FallState c = rate(now + b * (h / 2));
    const FallState d = rate(now + c * h);
    now += (a + 2 * b + 2 * c + d) * (h / 6);
  }
  return now;
}

// Parts are at distances that add up to zero: what they feel beyond the pull at the centre is of second
// order.
Vector3d pull_on(const CentralGravity& planet, const Vector3d& place, std::span<const FallingMass> parts) {
  Vector3d pull = acceleration_from(planet, place);
  for (const FallingMass& part : parts) pull += part.share * difference_from(planet, place, part.from_centre);
  return pull;
}

}  // namespace

FallingPoint fallen(const CentralGravity& planet, const FallingPoint& point, double seconds,
                    std::span<const FallingMass> parts) {
  FallState start = FallState::Zero();
  start.col(0) = point.place;
  start.col(1) = point.velocity;
  const FallState end = integrated(start, seconds, [&](const FallState& now) {
    FallState rate = FallState::Zero();
    rate.col(0) = now.col(1);
    rate.col(1) = pull_on(planet, now.col(0), parts);
    return rate;
  });
  return {end.col(0), end.col(1)};
}

FallingPoint fallen_beside(const CentralGravity& planet, const FallingPoint& point,
                           const FallingPoint& beside, double seconds) {
  FallState start;
  start << point.place, point.velocity, beside.place, beside.velocity;
  const FallState end = integrated(start, seconds, [&](const FallState& now) {
    FallState rate;
    rate << now.col(1), acceleration_from(planet, now.col(0)), now.col(3),
        difference_from(planet, now.col(0), now.col(2));
    return rate;
  });
  return {end.col(2), end.col(3)};
}

Vector3d torque_on(const CentralGravity& planet, const Vector3d& place, std::span<const FallingMass> parts) {
  Vector3d torque = Vector3d::Zero();
  for (const FallingMass& part : parts) {
    const Vector3d pull = difference_from(planet, place, part.from_centre);
    torque += part.share * part.from_centre.cross(pull);
  }
  return torque;
}

}  // namespace tessera
