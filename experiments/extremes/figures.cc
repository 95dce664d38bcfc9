#include "experiments/extremes/figures.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cli/measure/positions.h"

namespace tessera::extremes {
namespace {

using Rotation = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>;

template <std::size_t n>
std::ptrdiff_t lost(const std::array<double, n>& numbers) {
  return std::count_if(numbers.begin(), numbers.end(), [](double number) { return !std::isfinite(number); });
}

}  // namespace

double farthest(const Moment& start, const Moment& now) {
  return largest_distance(start.positions, now.positions);
}

double fastest(const Moment&, const Moment& now) {
  double fastest = 0;
  for (std::size_t i = 0; i < now.bodies.size(); ++i) {
    const double speed = now.velocity(i).norm();
    if (!std::isfinite(speed)) return std::numeric_limits<double>::infinity();
    fastest = std::max(fastest, speed);
  }
  return fastest;
}

double numbers_lost(const Moment&, const Moment& now) {
  std::ptrdiff_t count = 0;
  for (const BodyRecord& body : now.bodies) {
    const BodyState& state = body.state;
    count += lost(state.position) + lost(state.rotation) + lost(state.linear_velocity) +
             lost(state.angular_velocity);
  }
  return static_cast<double>(count);
}

Eigen::Vector3d angular_momentum(const BodyRecord& body) {
  const Rotation to_world(body.state.rotation.data());
  const Eigen::Vector3d inertia(body.properties.inertia.data());
  const Eigen::Vector3d spin = to_world.transpose() * Eigen::Vector3d(body.state.angular_velocity.data());
  return to_world * inertia.cwiseProduct(spin);
}

double energy(const Moment& moment, double gravity) {
  double sum = 0;
  for (std::size_t i = 0; i < moment.bodies.size(); ++i) {
    const double mass = moment.bodies[i].properties.mass;
    sum += 0.5 * mass * moment.velocity(i).squaredNorm() + mass * gravity * moment.positions[i].z() +
           0.5 * moment.spin(i).dot(angular_momentum(moment.bodies[i]));
  }
  return sum;
}

Figure energy_change(double gravity) {
  return [gravity](const Moment& start, const Moment& now) {
    return std::abs(energy(now, gravity) / energy(start, gravity) - 1);
  };
}

Figure energy_gain(double gravity) {
  return [gravity](const Moment& start, const Moment& now) {
    return energy(now, gravity) / energy(start, gravity) - 1;
  };
}

}  // namespace tessera::extremes
