// Assigns the sectors of a world that is being loaded to servers, and makes the load message of each.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "cluster.pb.h"
#include "lpss/grid/sector_map.h"
#include "lpss/model/body.h"
#include "lpss/model/joint.h"
#include "lpss/model/world_description.h"
#include "proto/snapshot.h"
#include "transport/link.h"

namespace tessera {

// A valid world, as described or from a snapshot.
struct WorldToLoad {
  struct Described {
    WorldDescription world;
    std::vector<BodyRecord> records;
    std::vector<JointRecord> joints;
  };
  std::variant<Described, ReadSnapshot> from;

  const std::string& name() const;
  const WorldSettings& settings() const;
  const SectorIndex& anchor() const;
  Tick tick() const;  // completed
};

struct Placement {
  SectorMap map;
  std::vector<v1::LoadWorld> loads;  // by rank
  std::size_t sectors = 0;           // with a body that can move
};

// Divides the world into runs of equal weight along the curve, one per node; a sector weighs 1, and each
// movable body 1. RESOURCE_EXHAUSTED if a server's part does not fit into a message of kLoadMessageBytesMax.
absl::StatusOr<Placement> place(std::uint64_t number, const WorldToLoad& world, std::span<const NodeId> nodes,
                                std::uint64_t map_epoch = 1);

}  // namespace tessera
