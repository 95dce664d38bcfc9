// Cloning: which copies of bodies, and which statics, are in the engine worlds.
#pragma once

#include "lpss/partition/partition.h"
#include "lpss/tick/parallel.h"

namespace tessera {

// Brings the engine worlds of the active sectors up to date, sector by sector: statics where bodies go far in
// this tick, and clones of what something living there may touch (the paper's "imminent contact").
void update_clones(Partition& partition, const ParallelFor& parallel);

}  // namespace tessera
