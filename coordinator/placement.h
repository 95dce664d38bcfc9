// Assigns the sectors of a world that is being loaded to servers, and makes the load message of each.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <span>
#include <vector>

#include "cluster.pb.h"
#include "coordinator/balance_policy.h"
#include "coordinator/world_to_load.h"
#include "lpss/grid/sector_map.h"
#include "proto/kept_chunks.h"
#include "transport/link.h"

namespace tessera {

// A server that is to take part.
struct Host {
  NodeId node;
  double capacity = 1;  // how much of the world it takes, by comparison with the others
};

struct Placement {
  SectorMap map;
  std::vector<v1::LoadWorld> loads;  // by rank
  std::size_t sectors = 0;           // with a body that can move
};

// Divides the world by first_map() among the hosts; a sector weighs 1, and each movable body 1.
// RESOURCE_EXHAUSTED if a server's part does not fit into a message of kLoadMessageBytesMax.
absl::StatusOr<Placement> place(std::uint64_t number, const WorldToLoad& world, std::span<const Host> hosts,
                                std::uint64_t map_epoch = 1, BalancePolicy policy = BalancePolicy::kCurve);

// What a server is sent that is to take part in a running world, without sectors: nothing of it is hosted
// there yet. `nodes` are those of `map`.
v1::LoadWorld guest_load(std::uint64_t number, const WorldToLoad& world, std::span<const NodeId> nodes,
                         const SectorMap& map);

// The state of a running world, as its servers had it.
struct KeptState {
  Tick tick = 0;
  const WorldSettings& settings;
  const SectorIndex& anchor;
  std::vector<ShapeEntry> shapes;
  const KeptChunks& chunks;
};

// Likewise; DATA_LOSS where a chunk cannot be read.
absl::StatusOr<Placement> place(std::uint64_t number, const KeptState& world, std::span<const Host> hosts,
                                std::uint64_t map_epoch, BalancePolicy policy);
v1::LoadWorld guest_load(std::uint64_t number, const KeptState& world, std::span<const NodeId> nodes,
                         const SectorMap& map);

}  // namespace tessera
