// Sleep: islands fall asleep and wake up as a unit, and sectors at rest leave the list of the next tick.
#pragma once

#include "lpss/tick/context.h"

namespace tessera {

// Lets a component that is part of an awake island wake up, or fall asleep with it. What wakes moves in this
// tick, as it does where nobody lives beyond a border.
void settle(Partition& partition, TickContext& context, Sector& sector, Component& component,
            bool all_want_sleep);

// Ends the tick: only sectors in which something is awake, changes home, or is not known to others stay
// active.
void retire_sectors(Partition& partition);

}  // namespace tessera
