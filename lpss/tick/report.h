// Report: what a server counted in a tick.
#pragma once

#include <vector>

#include "lpss/model/tick_counts.h"
#include "lpss/partition/partition.h"
#include "lpss/tick/parallel.h"

namespace tessera {

// Adds what can be counted at the end of a tick in which the sectors `stepped` took part.
void count(const Partition& partition, const std::vector<Sector*>& stepped, const ParallelFor& parallel,
           TickCounts& counts);

}  // namespace tessera
