// Coupling: islands beyond the cap are solved in parts, each where it is; after every pass the copies of the
// bodies that they share agree. What comes out is a function of the sectors and the cap, not of the servers.
#pragma once

#include <cstdint>
#include <vector>

#include "lpss/tick/context.h"
#include "lpss/tick/parallel.h"

namespace tessera {

bool beyond_cap(const Partition& partition, const SeamIsland& island);

// Plans the parts of an island that are solved here, and sends the bodies that they share.
void couple(Partition& partition, TickContext& context, const SeamIsland& island,
            std::vector<Shipment>& outbox);

// Gives every part its own bodies and copies of those that it shares, and sets up its rows.
void begin_parts(Partition& partition, std::vector<CoupledPart>& coupled, const std::vector<Shipment>& inbox,
                 const ParallelFor& parallel);

// What the last pass did to shared bodies; by rank.
std::vector<Coupling> changes_of_parts(std::size_t servers, const std::vector<CoupledPart>& coupled);

// Gives every copy of a body what all parts did to it, and makes the next pass. False once there is none.
bool next_pass(std::vector<CoupledPart>& coupled, const std::vector<Coupling>& inbox, std::uint32_t pass,
               const ParallelFor& parallel);

}  // namespace tessera
