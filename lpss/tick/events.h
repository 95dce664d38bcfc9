// Contact events: which pairs of bodies began, went on, or stopped touching in a tick.
#pragma once

#include <vector>

#include "lpss/partition/partition.h"
#include "lpss/partition/sectors.h"
#include "lpss/tick/messages.h"
#include "lpss/tick/parallel.h"

namespace tessera {

// Switches events on or off; between ticks. Contacts that are there already do not begin.
void report_contacts(Partition& partition, bool on);

// The events of a tick, ascending by (a, b), an end before a beginning and patches in one order: after
// solving, before bodies move. Nothing while they are off.
std::vector<ContactEvent> gather_events(Partition& partition, Tick tick, const std::vector<Sector*>& stepped,
                                        const Vacated& vacated, const ParallelFor& parallel);

}  // namespace tessera
