// Noise of sensors, from the numbers by chance of an instance.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "lpss/programs/program.h"

namespace tessera {

// About normal, of deviation 1: a sum of twelve evenly distributed numbers. The n-th of this tick.
inline double normal(const Senses& senses, std::uint32_t n) {
  constexpr std::uint32_t kNumbers = 12;
  double sum = 0;
  for (std::uint32_t k = 0; k < kNumbers; ++k) sum += senses.random(kNumbers * n + k);
  return sum - kNumbers / 2.0;
}

// Of this deviation in each direction: the numbers from `first` on.
inline Eigen::Vector3d noise_vector(const Senses& senses, double deviation, std::uint32_t first) {
  if (deviation == 0) return Eigen::Vector3d::Zero();
  return deviation *
         Eigen::Vector3d(normal(senses, first), normal(senses, first + 1), normal(senses, first + 2));
}

}  // namespace tessera
