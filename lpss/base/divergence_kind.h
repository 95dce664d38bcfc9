// Divergence: a body that left the range of numbers, speeds or sectors, or whose joints gained energy that
// nothing explains.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>

namespace tessera {

inline constexpr double kSpeedMax = 1e6;         // m/s
inline constexpr double kAngularSpeedMax = 1e5;  // rad/s

enum class DivergenceKind : std::uint8_t {
  kPosition = 0,  // its position or rotation is not finite
  kVelocity = 1,  // a velocity is not finite, or its joints have no solution
  kSpeed = 2,     // it is faster than kSpeedMax, or would be
  kSector = 3,    // it passes the last sector
  kEnergy = 4,    // its joints have put in more than half of the energy of what they hold
};
inline constexpr auto kDivergenceKindLast = DivergenceKind::kEnergy;

// "position not finite", "speed above 1e+06 m/s", ...
const char* name_of(DivergenceKind kind);

// What a solver leaves of the velocities of a body whose joints gain energy, so that whoever hosts it knows.
// Numbers that grow beyond range do not leave it by this corner.
inline Eigen::Vector3d velocity_of_gained_energy() {
  return Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
}

// Whether a body of `radius` m may have such velocities (m/s, rad/s; world axes): they are finite, it is not
// faster than kSpeedMax, nor is its farthest point, unless the body turns by no more than kAngularSpeedMax.
std::optional<DivergenceKind> divergence_of(const Eigen::Vector3d& linear, const Eigen::Vector3d& angular,
                                            double radius);

}  // namespace tessera
