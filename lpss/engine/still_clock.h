// How long a body has been still, which decides when it may sleep.
#pragma once

#include <algorithm>

#include "lpss/model/settings.h"

namespace tessera {

template <typename Scalar>
struct StillClock {
  Scalar still_for = 0;  // s
  bool wants_sleep = false;
};

// The speeds below which a body is still.
template <typename Scalar>
struct StillLimits {
  Scalar linear = 0;   // m/s
  Scalar angular = 0;  // rad/s
};

// Of a body of this smallest extent and radius (m): small ones move less than half their size in a second,
// and the ends of large ones not much faster than their centres.
template <typename Scalar>
StillLimits<Scalar> still_limits(const WorldSettings& settings, double extent, double radius) {
  const double linear = std::min(settings.sleep_linear_speed, extent * 0.5);
  const double angular = std::min(settings.sleep_angular_speed, 2 * settings.sleep_linear_speed / radius);
  return {Scalar(linear), Scalar(angular)};
}

// After a tick of `dt` seconds at these squared speeds (m^2/s^2, rad^2/s^2). A tick at the sleeping speed
// cancels the time at rest of several ticks, and one at twice that speed four times as much: a moving body is
// awake immediately, but one of a large pile that slips for a tick now and then must not keep all the others
// awake.
template <typename Scalar>
StillClock<Scalar> still_clock(Scalar still_for, Scalar linear_squared, Scalar angular_squared,
                               const StillLimits<Scalar>& limits, double sleep_after, double dt) {
  constexpr Scalar kSlipSetback = 4;  // ticks
  const auto enough = Scalar(sleep_after);
  const Scalar moves = linear_squared / (limits.linear * limits.linear);
  const Scalar turns = angular_squared / (limits.angular * limits.angular);
  const bool is_still = moves < 1 && turns < 1;
  const Scalar gain = is_still ? 1 : -kSlipSetback * std::max(moves, turns);
  StillClock<Scalar> clock{std::max(Scalar(0), still_for + gain * Scalar(dt))};
  if (enough > 0) clock.still_for = std::min(clock.still_for, enough);
  clock.wants_sleep = is_still && enough > 0 && clock.still_for >= enough;
  return clock;
}

}  // namespace tessera
