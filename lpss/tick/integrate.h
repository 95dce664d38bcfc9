// Integration: velocities become motion.
#pragma once

#include <vector>

#include "lpss/partition/partition.h"
#include "lpss/tick/divergences.h"
#include "lpss/tick/parallel.h"

namespace tessera {

// Moves what is awake in the sectors that take part in the tick: bodies by their solved velocities, bodies
// alone in free flight, kinematic ones to where they were told. Returns those that diverged, and were
// stopped.
std::vector<Stopped> integrate(Partition& partition, const std::vector<Sector*>& stepped,
                               const ParallelFor& parallel);

}  // namespace tessera
