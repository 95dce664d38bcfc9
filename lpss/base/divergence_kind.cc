#include "lpss/base/divergence_kind.h"

namespace tessera {

const char* name_of(DivergenceKind kind) {
  static_assert(kSpeedMax == 1e6);
  switch (kind) {
    case DivergenceKind::kPosition:
      return "position not finite";
    case DivergenceKind::kVelocity:
      return "velocity not finite";
    case DivergenceKind::kSpeed:
      return "speed above 1e+06 m/s";
    case DivergenceKind::kSector:
      return "beyond the last sector";
    case DivergenceKind::kEnergy:
      return "joints that gain energy";
  }
  return "";
}

std::optional<DivergenceKind> divergence_of(const Eigen::Vector3d& linear, const Eigen::Vector3d& angular,
                                            double radius) {
  // What is not a number is not within bounds.
  const double turn = angular.squaredNorm();
  const bool is_slow = linear.squaredNorm() <= kSpeedMax * kSpeedMax;
  const bool turns_slowly =
      turn <= kAngularSpeedMax * kAngularSpeedMax || turn * (radius * radius) <= kSpeedMax * kSpeedMax;
  if (is_slow && turns_slowly) return std::nullopt;
  if (linear == velocity_of_gained_energy() && angular == linear) return DivergenceKind::kEnergy;
  const bool is_finite = linear.allFinite() && angular.allFinite();
  return is_finite ? DivergenceKind::kSpeed : DivergenceKind::kVelocity;
}

}  // namespace tessera
