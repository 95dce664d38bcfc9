#include "lpss/partition/replicas.h"

#include <algorithm>

#include "lpss/base/invariant.h"
#include "lpss/partition/bodies.h"
#include "lpss/partition/near_seam.h"
#include "lpss/partition/sectors.h"

namespace tessera {
namespace {

const auto by_body = [](const Clone* clone, BodyId id) { return clone->replica->id < id; };

// Takes a replica's clone off the list of its sector.
void unlist(Partition& partition, Clone& clone) {
  Sector& sector = *clone.sector;
  unplace_clone(partition, clone);
  sector.clones.erase(clone.replica->id);
  if (!sector.world && sector.clones.empty()) activate(partition, sector);  // to be dropped
}

// Whether the sector must look at the clone.
bool concerns_sector(const Replica& replica, const Clone& clone) {
  return clone.sector->world && (replica.state.activity != Activity::kAsleep || clone.is_placed());
}

void refresh(Partition& partition, const Replica& replica, Clone& clone) {
  clone.fresh = true;
  if (concerns_sector(replica, clone)) activate(partition, *clone.sector);
}

// Whether there is somebody whom a clone could meet.
bool is_inhabited(const Partition& partition, const SectorIndex& index) {
  const auto found = partition.sectors.find(index);
  return found == partition.sectors.end() ? partition.packed.contains(index) : !found->second->homes.empty();
}

Range range_of(const Partition& partition, const Clone& clone) {
  const Replica& replica = *clone.replica;
  const Eigen::Vector3d way = Eigen::Vector3d(replica.state.linear_velocity.data()) * partition.dt();
  if (replica.properties.motion != Motion::kDynamic || !is_fast(way, partition.margins, replica.surge))
    return Range::kUsual;
  return replica.home < clone.sector->index ? Range::kFastFromBelow : Range::kFast;
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
  replica.is_listed =
      replica.is_listed && replica.home == update.home && replica.replicated_in == update.replicated_in;
  replica.home = update.home;
  replica.next_home = update.next_home;
  replica.replicated_in = update.replicated_in;
  replica.state = update.state;
  replica.known_everywhere = update.known_everywhere;
  replica.jointed = update.jointed;
  replica.surge = update.surge;
}

ReplicaIntroduction introduction_of(const Replica& replica) { return {replica.id, replica.properties}; }

ReplicaUpdate update_of(const Replica& replica) {
  return {replica.id,        replica.home,
          replica.next_home, replica.replicated_in,
          replica.state,     replica.known_everywhere,
          replica.jointed,   replica.surge};
}

void note_moving(Partition& partition, const Replica& replica) {
  if (replica.next_home == replica.home) return;
  const auto end = partition.moving_replicas.end();
  if (std::find(partition.moving_replicas.begin(), end, replica.id) != end) return;
  partition.moving_replicas.push_back(replica.id);
}

Clone& clone_in(Partition& partition, Replica& replica, const SectorIndex& index) {
  const auto place = std::lower_bound(
      replica.clones.begin(), replica.clones.end(), index,
      [](const std::unique_ptr<Clone>& clone, const SectorIndex& s) { return clone->sector->index < s; });
  if (place != replica.clones.end() && (*place)->sector->index == index) return **place;
  Clone& clone = **replica.clones.insert(place, std::make_unique<Clone>());
  clone.replica = &replica;
  clone.sector = &sector_at(partition, index);
  clone.sector->clones[replica.id] = &clone;
  return clone;
}

bool refresh_listed(Replica& replica) {
  if (!replica.is_listed) return false;
  bool is_all = true;
  for (const std::unique_ptr<Clone>& clone : replica.clones) {
    clone->fresh = true;
    is_all = is_all && (clone->sector->active || !concerns_sector(replica, *clone));
  }
  return is_all;
}

namespace {

// The partition's sectors that the replica names.
std::vector<SectorIndex> places_of(const Partition& partition, const Replica& replica) {
  std::vector<SectorIndex> places;
  replica.replicated_in.for_each([&](const SectorOffset& offset) {
    const absl::StatusOr<SectorIndex> sector = translated(replica.home, offset);
    if (sector.ok() && partition.hosts(*sector)) places.push_back(*sector);
  });
  return places;
}

void keep_clones_in(Partition& partition, Replica& replica, const std::vector<SectorIndex>& places) {
  std::erase_if(replica.clones, [&](const std::unique_ptr<Clone>& clone) {
    if (std::binary_search(places.begin(), places.end(), clone->sector->index)) return false;
    unlist(partition, *clone);
    return true;
  });
}

}  // namespace

void unlist_left_clones(Partition& partition, Replica& replica) {
  keep_clones_in(partition, replica, places_of(partition, replica));
}

void list_clones(Partition& partition, Replica& replica) {
  if (replica.is_listed) {
    for (const std::unique_ptr<Clone>& clone : replica.clones) refresh(partition, replica, *clone);
    return;
  }
  std::vector<SectorIndex> places = places_of(partition, replica);
  if (replica.goes_far())
    std::erase_if(places, [&](const SectorIndex& place) { return !is_inhabited(partition, place); });
  keep_clones_in(partition, replica, places);
  for (const SectorIndex& place : places) {
    Clone& clone = clone_in(partition, replica, place);
    clone.home = metres_between(place, replica.home, partition.sector_size());
    refresh(partition, replica, clone);
  }
  replica.is_listed = !replica.goes_far();
}

void forget_replica(Partition& partition, BodyId id) {
  const auto found = partition.replicas.find(id);
  if (found == partition.replicas.end()) return;
  for (const std::unique_ptr<Clone>& clone : found->second->clones) unlist(partition, *clone);
  partition.replicas.erase(found);
}

void lift_clones(Partition& partition, BodyId id) {
  const auto replica = partition.replicas.find(id);
  if (replica == partition.replicas.end()) return;
  for (const std::unique_ptr<Clone>& clone : replica->second->clones) {
    if (!clone->is_placed()) continue;
    wake_touching(partition, *clone->sector, clone->slot);
    unplace_clone(partition, *clone);
  }
}

BodyState state_of(const Clone& clone) {
  BodyState state = clone.replica->state;
  Eigen::Map<Eigen::Vector3d>(state.position.data()) += clone.home;
  return state;
}

void place_clone(const Partition& partition, Clone& clone) {
  Sector& sector = *clone.sector;
  const Replica& replica = *clone.replica;
  clone.slot =
      sector.world->add({replica.id, replica.home, replica.properties, state_of(clone)}, Role::kClone);
  sector.placed.insert(std::lower_bound(sector.placed.begin(), sector.placed.end(), replica.id, by_body),
                       &clone);
  sector.components_stale = true;
  foresee_clone(partition, clone);
}

void foresee_clone(const Partition& partition, const Clone& clone) {
  const Replica& replica = *clone.replica;
  SectorWorld& world = *clone.sector->world;
  world.set_range(clone.slot, range_of(partition, clone));
  world.set_jointed(clone.slot, replica.jointed);
  const bool is_asleep = replica.state.activity == Activity::kAsleep;
  world.set_surge(clone.slot, is_asleep ? 0 : replica.surge);
  partition.rules.pull_clone(partition, clone);
}

void remove_clone(Clone& clone) {
  Sector& sector = *clone.sector;
  sector.world->remove(clone.slot);
  clone.slot = kNoSlot;
  sector.placed.erase(
      std::lower_bound(sector.placed.begin(), sector.placed.end(), clone.replica->id, by_body));
  sector.components_stale = true;
}

void unplace_clone(Partition& partition, Clone& clone) {
  if (!clone.is_placed()) return;
  remove_clone(clone);
  activate(partition, *clone.sector);
}

}  // namespace tessera
