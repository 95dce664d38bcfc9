// Which server hosts which sectors of a world that is being loaded, and what each of them must be told.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <span>
#include <vector>

#include "cluster.pb.h"
#include "lpss/grid/sector_map.h"
#include "lpss/model/body.h"
#include "lpss/model/joint.h"
#include "lpss/model/world_description.h"
#include "transport/link.h"

namespace tessera {

struct Placement {
  SectorMap map;
  std::vector<v1::LoadWorld> loads;  // by rank
  std::size_t sectors = 0;           // with a body that can move
};

// Cuts the world into runs of equal weight along the curve (a sector weighs 1, and each body that can move
// 1), one per node. `world` and its records are valid. RESOURCE_EXHAUSTED where a server's part does not
// fit in a message of kLoadMessageBytesMax.
absl::StatusOr<Placement> place(std::uint64_t number, const WorldDescription& world,
                                std::span<const BodyRecord> records, std::span<const JointRecord> joints,
                                std::span<const NodeId> nodes);

}  // namespace tessera
