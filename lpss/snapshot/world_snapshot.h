// A world between two ticks, as data: what it is made of, and its state. Whoever goes on from it, on any
// number of partitions, gets the bits that the world would have had.
#pragma once

#include <absl/status/status.h>

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "lpss/model/settings.h"
#include "lpss/model/shape.h"
#include "lpss/partition/world_state.h"
#include "lpss/tick/messages.h"

namespace tessera {

struct WorldSnapshot {
  WorldSettings settings;
  SectorIndex anchor;
  Tick tick = 0;                   // completed
  std::vector<ShapeEntry> shapes;  // ascending by ids
  SharedState shared;
  std::vector<MovedSector> sectors;  // all, ascending
};

// Whether a partition can take the state over: INVALID_ARGUMENT, naming the body, joint or sector, where it
// contradicts itself or is out of bounds. Contact points are checked apart, by the engine that reads them.
absl::Status validate(const WorldSnapshot& world);

// What the sectors in which bodies live weigh: 1, and 1 a body.
std::vector<std::pair<SectorIndex, double>> load_of(const WorldSnapshot& world);

// Fills a new partition, which has the world's shapes, with its part of a snapshot that is valid.
// INVALID_ARGUMENT, and the partition must not be used, where its engine cannot read contact points, or
// islands are not as contacts connect them.
absl::Status resume(Partition& partition, const SharedState& shared, std::span<const MovedSector> sectors);

// Likewise for a partition without shapes.
absl::Status resume(Partition& partition, const WorldSnapshot& world);

}  // namespace tessera
