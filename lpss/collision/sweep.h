// How far a convex shape goes along a line, without turning, until it touches another one. In double
// precision.
//
// By conservative advancement: shapes that are apart by a gap, and come closer along its direction at some
// rate, do not touch before that gap is gone. The distance is exact to 1e-6 m, save where a shape grazes
// another one: there, a gap or overlap of so much decides.
//
// Shapes that overlap by more than kSweepTouching at the start touch there, whichever way one goes. Those
// that overlap by less do so only if they come closer by more than 1e-6 m on a metre; so a shape may slide
// along another one, and leave it. Bits depend on the arguments alone; where shapes touch does not depend on
// how far the way goes on.
//
// Source: Mirtich, Impulse-based Dynamic Simulation of Rigid Body Systems, 1996, section 2.3.
#pragma once

#include <optional>

#include "lpss/collision/core.h"

namespace tessera::collision {

inline constexpr double kSweepTouching = 1e-4;  // m

struct SweepContact {
  double distance = 0;                                // m, that a has gone
  Vector3<double> normal = Vector3<double>::UnitZ();  // on b, pointing to a; unit length
};

// The way of a: `length` m along `direction` (unit length, world axes).
struct SweepWay {
  Vector3<double> direction;
  double length = 0;
};

// Cores should round nothing off (Core::margin), save of balls and capsules. Nothing if they do not touch.
std::optional<SweepContact> sweep(const Core<double>& a, const Core<double>& b,
                                  const Placement<double>& start, const SweepWay& way);

// Likewise of what is known by its gap at the start along a normal that stays, as of a plane.
std::optional<SweepContact> sweep_at_plane(double gap, const Vector3<double>& normal, const SweepWay& way);

}  // namespace tessera::collision
