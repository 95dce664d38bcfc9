// Transfer: sectors that change servers, before anything else happens in a tick.
#pragma once

#include <vector>

#include "lpss/partition/partition.h"
#include "lpss/tick/messages.h"

namespace tessera {

// Whether the map changes at the beginning of this tick; all servers agree.
bool moves_sectors(const WorldSettings& settings, Tick tick);

// Draws the next map and packs the sectors that it gives to others; by rank.
std::vector<Transfer> give_sectors(Partition& partition, Tick tick);

// Takes over what others gave, and goes on with it as they would have.
void take_sectors(Partition& partition, const std::vector<Transfer>& inbox);

}  // namespace tessera
