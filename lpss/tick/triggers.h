// Triggers: parts of bodies that notice what overlaps them, and touch nothing.
//
// A trigger, of a body of any motion, notices parts that are no triggers, of other bodies, where one of the
// two bodies can move; not what is of the same assembly, what a joint keeps apart, or what collision bits do.
// It never pushes or wakes anybody, nor do rays, sweeps and queries meet it. What is in it is looked at where
// bodies are as a tick begins, as contacts are; what goes farther in a tick than half of its thickness, and
// of the trigger's, is also looked at on its way, as its velocity says it goes, until it hits something. Two
// that rest stay what they are.
//
// A pair is looked after by the home of its dynamic body, or of the one that can move; of two of a kind, as
// contacts are (near_seam.h). What is in what lasts: it moves with pairs and sectors, and is in snapshots.
#pragma once

#include <absl/container/flat_hash_set.h>

#include <vector>

#include "lpss/partition/partition.h"
#include "lpss/partition/sectors.h"
#include "lpss/tick/messages.h"
#include "lpss/tick/parallel.h"

namespace tessera {

// After detection. The events of the tick, ascending by (trigger, visitor), an end before a beginning;
// nothing while events are off. Appends the triggers into which something came, or which it left, to
// `changed`.
std::vector<ContactEvent> look_at_triggers(Partition& partition, Tick tick, const Vacated& vacated,
                                           const ParallelFor& parallel, std::vector<BodyId>& changed);

// Pairs with a body that changes homes, which another sector looks after from this tick on: they leave for
// there. `moving` are those bodies.
void send_overlaps(Partition& partition, Sector& sector, const absl::flat_hash_set<BodyId>& moving,
                   std::vector<Exchange>& outbox);

// Those that have come.
void take_overlap(Sector& sector, const ManifoldTransfer& transfer);

}  // namespace tessera
