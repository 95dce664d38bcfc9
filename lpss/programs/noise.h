// Noise of sensors, from the numbers by chance of an instance.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "lpss/base/portable_math.h"
#include "lpss/programs/numbers.h"
#include "lpss/programs/program.h"

namespace tessera {

// About normal, of deviation 1: a sum of twelve evenly distributed numbers. The n-th of this tick.
inline double normal(const Senses& senses, std::uint32_t n) {
  constexpr std::uint32_t kNumbers = 12;
  double sum = 0;
  for (std::uint32_t k = 0; k < kNumbers; ++k) sum += senses.random(kNumbers * n + k);
  return sum - kNumbers / 2.0;
}

// The same in all ticks.
inline double normal_for_ever(const Senses& senses, std::uint32_t n) {
  Senses at_first = senses;
  at_first.tick = 0;
  return normal(at_first, n);
}

// Of this deviation in each direction: the numbers from `first` on.
inline Eigen::Vector3d noise_vector(const Senses& senses, double deviation, std::uint32_t first) {
  if (deviation == 0) return Eigen::Vector3d::Zero();
  return deviation *
         Eigen::Vector3d(normal(senses, first), normal(senses, first + 1), normal(senses, first + 2));
}

// What a sensor has beside noise that is drawn anew in each tick: five parameters in this order.
struct LastingErrors {
  double offset = 0;      // the mean error
  double bias = 0;        // the deviation of an error that an instance keeps
  double drift = 0;       // the deviation of one that wanders
  double drift_time = 0;  // s, after which its correlation is 1 / e
  double precision = 0;   // of what is shown: whole multiples; 0: as it is
};

template <typename Place>
LastingErrors lasting_errors(const Senses& senses, Place first) {
  const double* const numbers = &at(senses.parameters, first);
  return {numbers[0], numbers[1], numbers[2], numbers[3], numbers[4]};
}

// What is shown of `measured`. `drift`, which is kept, wanders; `first` and `second` are the numbers by
// chance that the bias and the drift use.
inline double with_lasting_errors(const Senses& senses, const LastingErrors& errors, double measured,
                                  std::uint32_t first, std::uint32_t second, double& drift) {
  double shown = measured + errors.offset;
  if (errors.bias > 0) shown += errors.bias * normal_for_ever(senses, first);
  if (errors.drift > 0) {
    const double kept =
        errors.drift_time > 0 ? portable::pow(std::numbers::e, -senses.dt / errors.drift_time) : 0;
    drift = kept * drift + errors.drift * std::sqrt(1 - kept * kept) * normal(senses, second);
    shown += drift;
  }
  return errors.precision > 0 ? errors.precision * std::round(shown / errors.precision) : shown;
}

// Of each direction; the numbers from `first` on are used.
inline Eigen::Vector3d with_lasting_errors(const Senses& senses, const LastingErrors& errors,
                                           const Eigen::Vector3d& measured, std::uint32_t first,
                                           Eigen::Map<Eigen::Vector3d> drift) {
  Eigen::Vector3d shown;
  for (int axis = 0; axis < 3; ++axis) {
    const auto n = first + static_cast<std::uint32_t>(axis);
    shown[axis] = with_lasting_errors(senses, errors, measured[axis], n, n + 3, drift[axis]);
  }
  return shown;
}

}  // namespace tessera
