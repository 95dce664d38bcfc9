#include "lpss/model/gravity.h"

#include <cmath>

namespace tessera {
namespace {

Eigen::Vector3d pull(const CentralGravity& planet, const Eigen::Vector3d& from_centre) {
  const double distance = from_centre.norm();
  if (distance == 0) return Eigen::Vector3d::Zero();
  const double ratio = planet.radius / distance;
  const double strength = distance < planet.radius ? planet.surface / ratio : planet.surface * ratio * ratio;
  return from_centre * (-strength / distance);
}

}  // namespace

Eigen::Vector3d acceleration_from(const Gravity& gravity, const Eigen::Vector3d& from_centre) {
  if (const auto* uniform = std::get_if<UniformGravity>(&gravity)) return uniform->acceleration;
  return pull(std::get<CentralGravity>(gravity), from_centre);
}

Eigen::Vector3d difference_from(const Gravity& gravity, const Eigen::Vector3d& from_centre,
                                const Eigen::Vector3d& beyond) {
  const auto* planet = std::get_if<CentralGravity>(&gravity);
  if (planet == nullptr) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d there = from_centre + beyond;
  const double distance = from_centre.norm();
  if (distance < planet->radius || there.norm() < planet->radius)
    return pull(*planet, there) - pull(*planet, from_centre);
  // (1 + q)^(-3/2) - 1, with 1 + q the square of the ratio of both distances.
  const double q = beyond.dot(beyond + 2 * from_centre) / (distance * distance);
  const double root = std::sqrt(1 + q);
  const double factor = -q * (3 + q * (3 + q)) / ((1 + q) * root * (1 + (1 + q) * root));
  const double ratio = planet->radius / distance;
  return -(planet->surface * ratio * ratio / distance) * (beyond + there * factor);
}

Eigen::Vector3d mean_pull(const CentralGravity& planet, const Eigen::Vector3d& from_centre,
                          const Eigen::Vector3d& velocity, double dt) {
  const Eigen::Vector3d now = pull(planet, from_centre);
  return (pull(planet, from_centre - velocity * dt + now * (dt * dt / 2)) + now) / 2;
}

Eigen::Matrix3d gradient_at(const CentralGravity& planet, const Eigen::Vector3d& from_centre) {
  const double distance = from_centre.norm();
  if (distance < planet.radius) return Eigen::Matrix3d::Identity() * (-planet.surface / planet.radius);
  const double ratio = planet.radius / distance;
  const Eigen::Vector3d up = from_centre / distance;
  return planet.surface * ratio * ratio / distance * (3 * up * up.transpose() - Eigen::Matrix3d::Identity());
}

Eigen::Vector3d acceleration_at(const Gravity& gravity, const SectorIndex& home,
                                const Eigen::Vector3d& position, double sector_size) {
  if (const auto* uniform = std::get_if<UniformGravity>(&gravity)) return uniform->acceleration;
  const auto& planet = std::get<CentralGravity>(gravity);
  return pull(planet,
              metres_between(planet.centre.sector, home, sector_size) + (position - planet.centre.local));
}

}  // namespace tessera
