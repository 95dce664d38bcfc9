// Motions with bounds of speed and acceleration, tick by tick.
#pragma once

#include <algorithm>
#include <cmath>

namespace tessera {

// A number that goes to another one, by at most `most`.
inline double nearer(double number, double goal, double most) {
  return number + std::clamp(goal - number, -most, most);
}

// A place on a straight way, with its rate.
struct WayPoint {
  double place = 0;
  double rate = 0;
};

// The largest rate of the next tick from which it can stop `left` away from here, where `change` is what it
// can lose in a tick. In n ticks that are each slower by that, it goes (n rate - n (n - 1) / 2 change) dt.
inline double braking_rate(double left, double change, double dt) {
  const double changes = left / (change * dt);
  const double ticks = std::max(std::ceil((std::sqrt(1 + 8 * changes) - 1) / 2), 1.0);
  return (changes / ticks + (ticks - 1) / 2) * change;
}

// Where it is after the next tick, on its way to `goal`, where it comes to a stop. What is too fast, or goes
// the other way, brakes first.
inline WayPoint next_on_way(WayPoint now, double goal, double speed, double acceleration, double dt) {
  const double change = acceleration * dt;
  const double left = goal - now.place;
  if (std::abs(now.rate) <= change && std::abs(left) <= change * dt * (1 + 1e-9)) return {goal, left / dt};
  const double side = left > 0 ? 1 : -1;
  const double wanted = std::min(speed, braking_rate(std::abs(left), change, dt));
  const double rate = nearer(now.rate, side * wanted, change);
  return {now.place + rate * dt, rate};
}

}  // namespace tessera
