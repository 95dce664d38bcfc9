// How the surface of a carrier moves within a tick: of a kinematic body that is accelerated, or turns.
//
// A body on it ends each tick with the velocity v of the surface below it, and moves on by v dt. It stays
// where it is on the carrier if v is the way of that place by dt: along the chord of its arc, not along the
// tangent, which would take it outwards by w^2 r dt^2 / 2 a tick. From tick to tick, v changes evenly over
// the steps, so that friction bears the same in each of them, and begins a tick with what it bore in the last
// one.
#pragma once

#include "lpss/native/body.h"
#include "lpss/solver/contact_solver.h"

namespace tessera::native {

// Whether the velocities of a body say less than all of how its surface moves in the tick.
inline bool has_course(const Body& body) {
  return body.motion == Motion::kKinematic &&
         (!body.angular.isZero(0) || !body.angular_before.isZero(0) || body.linear != body.linear_before);
}

// Whether a body turned with the carrier up to this tick, so that what touches stays the same. Otherwise, as
// over a roller, the place of contact does not go along with the surface: velocities say how that moves.
bool rides_on(const Body& carrier, const Body& rider);

// Of the surface at `arm` (m, world axes) from the centre of a kinematic body in a tick of `dt` seconds,
// beyond linear + angular x lever. The lever is that of a contact, whose points stay where they are on the
// carrier for a while when something slides over it.
SolverTypes<Scalar>::Course course_at(const Body& body, const Vector& arm, const Vector& lever,
                                      bool is_ridden, double dt);

// What acted on the surface in the last tick, turned as the surface has turned since.
Vector turned_with(const Body& body, const Vector& impulse, double dt);

}  // namespace tessera::native
