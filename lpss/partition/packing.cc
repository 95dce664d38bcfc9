#include "lpss/partition/packing.h"

#include <algorithm>

#include "lpss/partition/bodies.h"
#include "lpss/partition/moved_sector.h"
#include "lpss/partition/near_seam.h"
#include "lpss/partition/statics.h"

namespace tessera {
namespace {

bool is_at_rest(const HomeBody& body) {
  return !body.jointed && !body.known_everywhere && !body.dirty && !body.next_home &&
         !body.kinematic_target && body.sector->world->activity(body.slot) == Activity::kAsleep;
}

bool is_at_rest(const Clone& clone) {
  const Replica& replica = *clone.replica;
  return replica.state.activity == Activity::kAsleep && replica.next_home == replica.home;
}

bool may_be_packed(const Sector& sector) {
  return !sector.active && sector.kinematics.empty() && sector.programmed.empty() &&
         std::all_of(sector.homes.begin(), sector.homes.end(),
                     [](const HomeBody* body) { return is_at_rest(*body); }) &&
         std::all_of(sector.clones.begin(), sector.clones.end(),
                     [](const auto& clone) { return is_at_rest(*clone.second); });
}

// Carriers, and what is aboard of one that is dynamic, count in each tick.
bool counts_at_rest(const Partition& partition, const Sector& sector) {
  return std::ranges::any_of(partition.carried, [&](const CarriedFrame& carried) {
    const BodyId carrier = partition.settings.frames[carried.frame - 1].carrier->body;
    return (carried.is_borne && carried.frame == sector.index.frame) ||
           std::ranges::any_of(sector.homes, [&](const HomeBody* body) { return body->id == carrier; });
  });
}

void pack(Partition& partition, Sector& sector) {
  std::vector<std::pair<BodyId, BodyId>> touching;
  if (sector.world) {
    for (const ContactPair& pair : sector.world->contacts()) {
      if (pair.touching) touching.emplace_back(pair.a, pair.b);
    }
  }
  partition.packed.add(pack_sector(partition, sector), touching,
                       sector.world && sector.world->has_triggers());
  forget_sector(partition, sector);
}

}  // namespace

void note_rest(Partition& partition, Sector& sector) {
  if (partition.rules.clones_are_solved()) return;  // such sectors have more that lasts
  sector.rests_since = partition.ticks_ended;
  partition.resting.emplace_back(partition.ticks_ended, sector.index);
}

void pack_resting(Partition& partition) {
  ++partition.ticks_ended;
  std::size_t left = std::max(kPackedAtOnce, partition.resting.size() / kPackedShare);
  while (!partition.resting.empty() && left > 0) {
    const auto [since, index] = partition.resting.front();
    if (partition.ticks_ended - since <= partition.pack_after) return;
    partition.resting.pop_front();
    const auto found = partition.sectors.find(index);
    if (found == partition.sectors.end() || found->second->rests_since != since) continue;
    Sector& sector = *found->second;
    if (may_be_packed(sector) && !counts_at_rest(partition, sector)) {
      pack(partition, sector);
      --left;
    } else if (!sector.active) {
      note_rest(partition, sector);
      --left;
    }
  }
}

void bring_back(Partition& partition, const SectorIndex& index) {
  if (!partition.packed.contains(index)) return;
  unpack_sector(partition, partition.packed.take(index));
  Sector& sector = *partition.sectors.at(index);
  if (sector.active) {
    sector.active = false;
    std::erase(partition.active, &sector);
  }
  sector.components_stale = sector.world != nullptr;
  note_rest(partition, sector);
}

void bring_back_holding(Partition& partition, BodyId id) {
  for (const SectorIndex& index : partition.packed.holding(id)) bring_back(partition, index);
}

void bring_back_touching(Partition& partition, BodyId id) {
  for (const SectorIndex& index : partition.packed.touching(id)) bring_back(partition, index);
}

void bring_back_near_borders(Partition& partition) {
  // m, of the box of a body at rest beyond its ball: the distance at which contacts are found, and rounding.
  constexpr double kSlack = 0.1;
  const Eigen::AlignedBox3d inside = cube(partition.sector_size() / 2 - partition.margins.reach - kSlack);
  for (const SectorIndex& index : partition.packed.sectors()) {
    bool is_near = false;
    partition.packed.for_each_body(index, [&](const BodyRecord& record) {
      const double radius = radius_of(partition, record.properties);
      is_near |= !inside.contains(swept_ball(record.state, radius, partition.dt()));
    });
    if (is_near) bring_back(partition, index);
  }
}

}  // namespace tessera
