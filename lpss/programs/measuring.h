// When sensors with a rate of their own measure.
#pragma once

#include <cmath>
#include <cstdint>

#include "lpss/model/body.h"

namespace tessera {

// How often a sensor has measured until the end of a tick of `dt` (s), at `rate` (Hz), up to a constant: it
// measures in each tick in which this grows. Sensors take turns, so that not all of them measure in one tick.
inline double measurements_until(BodyId body, std::uint32_t program, std::uint64_t tick, double dt,
                                 double rate) {
  constexpr double kGolden = 0.6180339887498949;  // the fractions of its multiples lie evenly
  const double turn =
      static_cast<double>(body.value) * kGolden + static_cast<double>(program) * kGolden * kGolden;
  // A millionth more, so that a rate of which ticks are multiples is kept.
  return std::floor(static_cast<double>(tick) * dt * rate + (turn - std::floor(turn)) + 1e-6);
}

}  // namespace tessera
