// Transfer: sectors that change servers, before anything else happens in a tick.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "lpss/partition/partition.h"
#include "lpss/tick/messages.h"

namespace tessera {

// The map of a world whose authority is shuffled, where it changes at the beginning of this tick; all servers
// draw the same.
std::optional<SectorMap> shuffled_map(const Partition& partition, Tick tick);

// Another division of the world among its servers, who may be others than before.
struct MapChange {
  SectorMap map;
  Rank self = 0;  // by that map
  // Those that take part from now on, the last ranks of the map: the first server tells them what they lack.
  // One that no longer takes part must not have had sectors by the map before.
  std::uint32_t newcomers = 0;
};

// Changes the map, and packs the sectors that it gives to others; by rank.
std::vector<Transfer> give_sectors(Partition& partition, MapChange change);

// Takes over what others gave, and goes on with it as they would have.
void take_sectors(Partition& partition, const std::vector<Transfer>& inbox);

}  // namespace tessera
