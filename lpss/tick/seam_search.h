// Seam search: which sectors need a replica of which body.
#pragma once

#include "lpss/partition/partition.h"
#include "lpss/tick/parallel.h"

namespace tessera {

// Attends to the bodies that may have moved and come near a border; the others are inside, and need nobody.
// Then says of all that are attended whether they have moved, or something about them changed, since others
// last heard of them, and what these sweep.
void attend_borders(Partition& partition, const ParallelFor& parallel = {});

// Finds the sectors that need replicas of those.
void search_seams(Partition& partition, const ParallelFor& parallel = {});

}  // namespace tessera
