// Who has to hear of a body: sets of servers.
#pragma once

#include <bit>
#include <cstdint>
#include <utility>
#include <vector>

#include "lpss/grid/sector_map.h"
#include "lpss/tick/messages.h"

namespace tessera {

// A set of ranks; kServersMax is 64.
using Ranks = std::uint64_t;

// The servers of the sectors at `replicated_in` from `home`.
Ranks owners(const SectorMap& map, const SectorIndex& home, const OffsetSet& targets);

Ranks everyone(const SectorMap& map);

template <typename Visit>
void for_each_rank(Ranks ranks, Visit&& visit) {
  for (; ranks != 0; ranks &= ranks - 1) visit(static_cast<Rank>(std::countr_zero(ranks)));
}

// Tells every server that has to know of a body, or had to until now.
void announce(std::vector<Exchange>& outbox, const BodyProperties& properties, const ReplicaUpdate& update,
              Ranks before, Ranks now);

}  // namespace tessera
