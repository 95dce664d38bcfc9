// Islands: the parts of all sectors become islands over sectors and servers, each with one solver.
#pragma once

#include <vector>

#include "lpss/tick/context.h"
#include "lpss/tick/messages.h"
#include "lpss/tick/parallel.h"

namespace tessera {

// Joins the parts that all servers reported, lets islands wake up or fall asleep, and plans what is solved
// where (`context.plan`). All servers come to the same islands and solvers. Returns the parts to be shipped,
// by rank.
std::vector<Shipment> plan_islands(Partition& partition, TickContext& context,
                                   const std::vector<const Seams*>& inbox, const ParallelFor& parallel);

}  // namespace tessera
