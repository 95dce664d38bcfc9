// Transfer: sectors that change servers, before anything else happens in a tick.
#pragma once

#include <optional>
#include <vector>

#include "lpss/partition/partition.h"
#include "lpss/tick/messages.h"

namespace tessera {

// The map of a world whose authority is shuffled, where it changes at the beginning of this tick; all servers
// draw the same.
std::optional<SectorMap> shuffled_map(const Partition& partition, Tick tick);

// Changes the map, and packs the sectors that it gives to others; by rank.
std::vector<Transfer> give_sectors(Partition& partition, SectorMap map);

// Takes over what others gave, and goes on with it as they would have.
void take_sectors(Partition& partition, const std::vector<Transfer>& inbox);

}  // namespace tessera
