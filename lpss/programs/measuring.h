// When sensors with a rate of their own measure.
#pragma once

#include <cmath>
#include <cstdint>

#include "lpss/programs/numbers.h"
#include "lpss/programs/program.h"

namespace tessera {

// The body that a parameter names, or else the own one.
template <typename Place>
BodyId body_or_own(const Senses& senses, Place place) {
  const BodyId named{static_cast<std::uint64_t>(at(senses.parameters, place))};
  return named.value == 0 ? senses.body : named;
}

// A kinematic body sleeps while it stands, whatever moves around it: its sensors measure nevertheless, again
// in so many ticks.
inline void keep_measuring(const Senses& senses, Actor& actor, std::uint64_t ticks = 1) {
  if (senses.properties.motion == Motion::kKinematic) actor.wake_in(ticks);
}

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
