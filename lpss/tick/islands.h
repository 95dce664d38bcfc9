// Islands: the parts of all sectors become islands over sectors and servers, each with one solver.
#pragma once

#include <span>
#include <vector>

#include "lpss/tick/context.h"
#include "lpss/tick/messages.h"
#include "lpss/tick/parallel.h"

namespace tessera {

// Takes over the parts that all servers reported. Returns the sectors that they found them in.
std::vector<SectorIndex> take_parts(Partition& partition, const std::vector<const Seams*>& inbox);

// Joins parts, lets islands wake up or fall asleep, and plans what is solved where (`context.plan`). `awake`
// are the sectors whose parts were found in this tick. All servers of an island come to the same solver.
// Returns the parts to be shipped, by rank.
std::vector<Shipment> plan_islands(Partition& partition, TickContext& context,
                                   std::span<const SectorIndex> awake, const ParallelFor& parallel);

}  // namespace tessera
