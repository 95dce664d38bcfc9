// Shipping: the parts of an island travel to the server that solves it, and the solution travels back.
#pragma once

#include <absl/container/flat_hash_map.h>

#include <memory>
#include <utility>
#include <vector>

#include "lpss/partition/partition.h"
#include "lpss/tick/island_task.h"
#include "lpss/tick/messages.h"

namespace tessera {

// Packs a component: its bodies with their forces, its contacts, and the kinematic bodies that it touches.
void ship_part(const Partition& partition, const Sector& sector, const Component& component,
               ShippedIsland& parcel);

// The engine worlds that carry another server's part of an island to the solver. Nothing is detected in them.
class Carriers {
 public:
  // Fills `builder` with the shipped bodies and contacts. `own` are the bodies of this partition that the
  // shipped contacts may refer to as clones.
  Carriers(Engine& engine, double sector_size, const std::vector<const ShippedBody*>& bodies,
           std::vector<const ShippedContact*> contacts, const absl::flat_hash_map<BodyId, BodyRecord>& own,
           TaskBuilder& builder);

  bool carries(BodyId id) const { return homes_.contains(id); }

  // The solved bodies and contacts, each to be sent to the server that owns its sector.
  void collect(const SectorMap& map, std::vector<Solution>& outbox) const;

 private:
  SectorWorld& world_of(const SectorIndex& sector);

  struct Carried {
    SectorIndex home;
    WorldBody place;
  };

  Engine& engine_;
  absl::flat_hash_map<SectorIndex, std::unique_ptr<SectorWorld>> worlds_;
  absl::flat_hash_map<BodyId, Carried> homes_;
  std::vector<std::pair<SectorIndex, WorldPair>> contacts_;
};

// Takes over velocities and impulses of what other servers solved.
void take_solution(Partition& partition, const Solution& solution);

}  // namespace tessera
