// Detection: every awake sector finds its contacts, near its own origin.
#pragma once

#include <vector>

#include "lpss/partition/partition.h"
#include "lpss/tick/parallel.h"

namespace tessera {

// Applies gravity and finds contacts in the active sectors in which something is awake. Returns these, in the
// order of the active ones.
std::vector<Sector*> detect(Partition& partition, const ParallelFor& parallel);

}  // namespace tessera
