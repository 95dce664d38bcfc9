#include "lpss/model/gravity.h"

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

Eigen::Vector3d acceleration_at(const Gravity& gravity, const SectorIndex& home,
                                const Eigen::Vector3d& position, double sector_size) {
  if (const auto* uniform = std::get_if<UniformGravity>(&gravity)) return uniform->acceleration;
  const auto& planet = std::get<CentralGravity>(gravity);
  return pull(planet,
              metres_between(planet.centre.sector, home, sector_size) + (position - planet.centre.local));
}

}  // namespace tessera
