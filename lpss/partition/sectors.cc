#include "lpss/partition/sectors.h"

#include <algorithm>

#include "lpss/partition/packing.h"
#include "lpss/partition/statics.h"

namespace tessera {

Sector& sector_at(Partition& partition, const SectorIndex& index) {
  bring_back(partition, index);
  std::unique_ptr<Sector>& sector = partition.sectors[index];
  if (!sector) {
    sector = std::make_unique<Sector>();
    sector->index = index;
    note_rest(partition, *sector);
  }
  return *sector;
}

SectorWorld& world_of(Partition& partition, Sector& sector) {
  if (!sector.world) {
    make_world(partition, sector,
               cube(partition.sector_size() / 2 + partition.margins.reach + partition.radius_max));
  }
  return *sector.world;
}

void make_world(Partition& partition, Sector& sector, const Eigen::AlignedBox3d& region) {
  sector.world = partition.engine.make_world();
  ++partition.world_count;
  add_statics(partition, sector, region);
}

void activate(Partition& partition, Sector& sector) {
  if (sector.active) return;
  sector.active = true;
  sector.resting.reset();
  partition.active.push_back(&sector);
  partition.body_moves.note_stirred(sector.index);
}

void wake_touching(Partition& partition, Sector& sector, BodySlot slot) {
  for (const ContactPair& pair : sector.world->contacts()) {
    if (pair.slot_a != slot && pair.slot_b != slot) continue;
    const BodyId partner = pair.slot_a == slot ? pair.b : pair.a;
    const auto body = partition.bodies.find(partner);
    if (body != partition.bodies.end() && body->second->sector == &sector) {
      sector.world->wake(body->second->slot);
      activate(partition, sector);
    }
  }
}

bool anything_awake(const Sector& sector) {
  const bool home = std::any_of(sector.homes.begin(), sector.homes.end(), [&](const HomeBody* body) {
    return sector.world->activity(body->slot) != Activity::kAsleep;
  });
  return home || std::any_of(sector.placed.begin(), sector.placed.end(), [](const Clone* clone) {
           return clone->replica->state.activity != Activity::kAsleep;
         });
}

void clear_components(Sector& sector) {
  sector.components_stale = false;
  sector.components.clear();
  sector.component_bodies.clear();
  sector.component_clones.clear();
  sector.component_pairs.clear();
  sector.parts.clear();
  sector.part_components.clear();
}

bool drop_if_empty(Partition& partition, Sector& sector, Vacated& vacated) {
  if (!sector.homes.empty()) return false;
  if (sector.world) {
    if (sector.parts_reported) vacated.sectors.push_back(sector.index);
    sector.parts_reported = false;
    clear_components(sector);
    for (const auto& [a, b] : sector.touching) vacated.ended_contacts.push_back({a, b});
    sector.touching.clear();
    vacated.ended_overlaps.insert(vacated.ended_overlaps.end(), sector.overlaps.begin(),
                                  sector.overlaps.end());
    sector.overlaps.clear();
    sector.statics.clear();
    sector.static_region.setEmpty();
    for (const auto& [id, clone] : sector.clones) clone->slot = clone->near = kNoSlot;
    sector.placed.clear();
    partition.clone_count -= sector.clones_counted;
    sector.clones_counted = 0;
    sector.world.reset();
    --partition.world_count;
  }
  sector.awake = false;
  sector.components_stale = false;
  if (!sector.clones.empty()) return false;
  partition.sectors.erase(SectorIndex(sector.index));
  return true;
}

}  // namespace tessera
