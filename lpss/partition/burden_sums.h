// Sums over bodies of a frame, for the body that carries it (lpss/tick/burden.h).
#pragma once

#include <array>
#include <cstdint>

#include "lpss/base/exact_sum.h"

namespace tessera {

// In the frame, about its origin. Matrices are symmetric: xx, xy, xz, yy, yz, zz.
struct BurdenSums {
  ExactSum mass;                     // kg
  std::array<ExactSum, 3> first;     // kg m: mass times place
  std::array<ExactSum, 6> second;    // kg m^2: mass times place times place
  std::array<ExactSum, 6> inertia;   // kg m^2, each about its centre
  std::array<ExactSum, 3> momentum;  // kg m/s, against the frame
  std::array<ExactSum, 3> spin;      // kg m^2/s, likewise
  std::uint64_t awake = 0;           // bodies

  BurdenSums& operator+=(const BurdenSums& other) {
    const auto add = [](auto& sums, const auto& others) {
      for (std::size_t n = 0; n < sums.size(); ++n) sums[n] += others[n];
    };
    mass += other.mass;
    add(first, other.first);
    add(second, other.second);
    add(inertia, other.inertia);
    add(momentum, other.momentum);
    add(spin, other.spin);
    awake += other.awake;
    return *this;
  }
};

}  // namespace tessera
