// Divergence: a body that left the range of numbers, speeds or sectors, or whose joints gained energy that
// nothing explains. It is stopped where the tick found it, and reported.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "lpss/model/body.h"
#include "lpss/model/joint.h"

namespace tessera {

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

// A body that diverged in a tick.
struct Divergence {
  std::uint64_t tick = 0;
  BodyId body;
  JointId joint;  // of its joints, the one whose error is largest; 0: none holds it
  DivergenceKind kind = DivergenceKind::kPosition;

  auto key() const { return std::tie(tick, body, kind, joint); }
  friend bool operator==(const Divergence& a, const Divergence& b) { return a.key() == b.key(); }
  friend bool operator<(const Divergence& a, const Divergence& b) { return a.key() < b.key(); }
};

// Each server tells of so many in a tick, and so many are kept of a world: the first ones. All are counted.
inline constexpr std::size_t kDivergencesKept = 64;

inline std::span<const Divergence> first_divergences(const std::vector<Divergence>& ascending) {
  return std::span(ascending).first(std::min(ascending.size(), kDivergencesKept));
}

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
