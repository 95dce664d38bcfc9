// Components: what contacts and joints connect inside each sector, and which of it reaches over a border.
#pragma once

#include "lpss/partition/partition.h"
#include "lpss/partition/sectors.h"
#include "lpss/tick/messages.h"
#include "lpss/tick/parallel.h"

namespace tessera {

// Finds the components of the active sectors that are awake or whose bodies have changed. Returns what others
// must know of the parts of islands that reach over a border, or no longer do: `vacated` are the sectors that
// have none.
Seams find_components(Partition& partition, const ParallelFor& parallel, const Vacated& vacated);

// A sector of which the seam graph has parts, with its components: they are found anew where it was packed.
Sector& with_components(Partition& partition, const SectorIndex& index);

// Finds the components of the sectors that the next tick does not look at, in a partition that was restored.
// False where their parts are not those that the seam graph has.
bool resume_components(Partition& partition);

}  // namespace tessera
