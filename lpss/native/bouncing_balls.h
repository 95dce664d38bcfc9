// The impact of two balls, where they met.
#pragma once

#include "lpss/native/body.h"
#include "lpss/native/contact.h"

namespace tessera::native {

// Two bodies that are balls and bounce have no contact before they overlap (NarrowPhase), and by then have
// moved past where they met: by up to the way of a tick of `dt` seconds, along which the line between their
// centres has turned. Sets the contact to the line of the time at which they met, when nothing had pushed
// them yet. Does nothing to others, or where they overlap by more than they approach in a tick.
void find_where_balls_met(const Body& a, const Body& b, Scalar dt, Contact& contact);

}  // namespace tessera::native
