#include "lpss/partition/replicas.h"

#include <algorithm>

#include "lpss/base/invariant.h"
#include "lpss/model/gravity.h"
#include "lpss/partition/bodies.h"
#include "lpss/partition/sectors.h"

namespace tessera {
namespace {

// Takes the replica off the list of one sector.
void unlist_replica(Partition& partition, BodyId id, const SectorIndex& place) {
  Sector& sector = *partition.sectors.at(place);
  const auto clone = sector.clones.find(id);
  invariant(clone != sector.clones.end(), "a replica knows the sectors that list it");
  unplace_clone(partition, sector, clone->second);
  sector.clones.erase(clone);
  if (!sector.world && sector.clones.empty()) activate(partition, sector);  // to be dropped
}

}  // namespace

Replica& introduce(Partition& partition, const ReplicaIntroduction& news) {
  std::unique_ptr<Replica>& replica = partition.replicas[news.id];
  if (!replica) replica = std::make_unique<Replica>();
  replica->id = news.id;
  replica->properties = news.properties;
  replica->radius = radius_of(partition, news.properties);
  return *replica;
}

void revise(Replica& replica, const ReplicaUpdate& update) {
  replica.is_placed =
      replica.is_placed && replica.home == update.home && replica.replicated_in == update.replicated_in;
  replica.home = update.home;
  replica.next_home = update.next_home;
  replica.replicated_in = update.replicated_in;
  replica.state = update.state;
}

void place_replica(Partition& partition, Replica& replica) {
  const auto refresh = [&](Sector& sector, Clone& clone) {
    clone.replica = &replica;
    clone.fresh = true;
    if (sector.world && (replica.state.activity != Activity::kAsleep || clone.slot != Clone::kNotPlaced)) {
      activate(partition, sector);
    }
  };
  if (replica.is_placed) {
    for (const SectorIndex& place : replica.places) {
      Sector& sector = *partition.sectors.at(place);
      refresh(sector, sector.clones.at(replica.id));
    }
    return;
  }
  std::vector<SectorIndex> places;
  replica.replicated_in.for_each([&](const SectorOffset& offset) {
    const absl::StatusOr<SectorIndex> sector = translated(replica.home, offset);
    if (sector.ok() && partition.hosts(*sector)) places.push_back(*sector);
  });
  for (const SectorIndex& old : replica.places) {
    if (std::binary_search(places.begin(), places.end(), old)) continue;
    unlist_replica(partition, replica.id, old);
  }
  for (const SectorIndex& place : places) {
    Sector& sector = sector_at(partition, place);
    refresh(sector, sector.clones[replica.id]);
  }
  replica.places = std::move(places);
  replica.is_placed = true;
}

void forget_replica(Partition& partition, BodyId id) {
  const auto found = partition.replicas.find(id);
  if (found == partition.replicas.end()) return;
  for (const SectorIndex& place : found->second->places) unlist_replica(partition, id, place);
  partition.replicas.erase(found);
}

void lift_clones(Partition& partition, BodyId id) {
  const auto replica = partition.replicas.find(id);
  if (replica == partition.replicas.end()) return;
  for (const SectorIndex& place : replica->second->places) {
    Sector& sector = *partition.sectors.at(place);
    Clone& clone = sector.clones.at(id);
    if (clone.slot == Clone::kNotPlaced) continue;
    wake_touching(partition, sector, clone.slot);
    unplace_clone(partition, sector, clone);
  }
}

BodyState seen_in(const Partition& partition, const Sector& sector, const Replica& replica) {
  BodyState state = replica.state;
  Eigen::Map<Eigen::Vector3d>(state.position.data()) +=
      metres_between(sector.index, replica.home, partition.sector_size());
  return state;
}

void place_clone(Partition& partition, Sector& sector, Clone& clone) {
  const Replica& replica = *clone.replica;
  clone.slot = sector.world->add(
      {replica.id, replica.home, replica.properties, seen_in(partition, sector, replica)}, Role::kClone);
  ++sector.clones_placed;
  sector.components_stale = true;
  pull_clone(partition, sector, clone);
}

void remove_clone(Sector& sector, Clone& clone) {
  sector.world->remove(clone.slot);
  clone.slot = Clone::kNotPlaced;
  --sector.clones_placed;
  sector.components_stale = true;
}

void unplace_clone(Partition& partition, Sector& sector, Clone& clone) {
  if (clone.slot == Clone::kNotPlaced) return;
  remove_clone(sector, clone);
  activate(partition, sector);
}

void pull_clone(const Partition& partition, const Sector& sector, const Clone& clone) {
  if (!clone.replica->properties.gravity || partition.settings.seams != SeamPolicy::kClone) return;
  sector.world->set_gravity(clone.slot,
                            acceleration_at(partition.settings.gravity, sector.index,
                                            sector.world->position(clone.slot), partition.sector_size()));
}

}  // namespace tessera
