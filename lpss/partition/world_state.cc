#include "lpss/partition/world_state.h"

#include <algorithm>
#include <utility>

#include "lpss/base/invariant.h"
#include "lpss/partition/bodies.h"
#include "lpss/partition/joints.h"
#include "lpss/partition/packing.h"

namespace tessera {

SharedState shared_state(const Partition& partition) {
  SharedState state = lately_heard(partition);
  state.radius_max = partition.radius_max;
  partition.statics.for_each([&](const BodyRecord& record) { state.statics.push_back(record); });
  if (all_know_joints(partition.settings))
    partition.joints.for_each([&](const JointTie& tie) { state.joints.push_back(tie); });
  return state;
}

SharedState lately_heard(const Partition& partition) {
  SharedState state;
  state.at_rest = partition.at_rest;
  state.acts = partition.acts;
  state.carried = partition.carried;
  for (const auto& [id, replica] : partition.replicas) {
    if (!replica->known_everywhere) continue;
    state.known_replicas.push_back({introduction_of(*replica), update_of(*replica)});
  }
  std::sort(state.known_replicas.begin(), state.known_replicas.end(),
            [](const KnownReplica& a, const KnownReplica& b) { return a.update.id < b.update.id; });
  return state;
}

void hear(Partition& partition, const SharedState& state) {
  for (const KnownReplica& known : state.known_replicas) {
    Replica& replica = introduce(partition, known.introduction);
    revise(replica, known.update);
    note_moving(partition, replica);
  }
  partition.at_rest = state.at_rest;
  partition.acts = state.acts;
  if (!state.carried.empty()) partition.carried = state.carried;
}

std::vector<ShapeEntry> shapes_of(const Partition& partition) {
  std::vector<ShapeEntry> shapes;
  for (const auto& [id, shape] : partition.shapes) shapes.push_back({id, shape});
  return shapes;
}

void for_each_sector(const Partition& partition, const std::function<void(MovedSector)>& visit) {
  std::vector<SectorIndex> all = partition.packed.sectors();
  all.reserve(all.size() + partition.sectors.size());
  for (const auto& [index, sector] : partition.sectors) all.push_back(index);
  std::sort(all.begin(), all.end());
  for (const SectorIndex& index : all) {
    const auto sector = partition.sectors.find(index);
    MovedSector moved = sector == partition.sectors.end() ? partition.packed.copy(index)
                                                          : pack_sector(partition, *sector->second);
    visit(with_parts(partition, std::move(moved)));
  }
}

std::vector<MovedSector> pack_sectors(const Partition& partition) {
  std::vector<MovedSector> sectors;
  sectors.reserve(partition.sectors.size() + partition.packed.counts().sectors);
  for_each_sector(partition, [&](MovedSector sector) { sectors.push_back(std::move(sector)); });
  return sectors;
}

void restore(Partition& partition, const SharedState& state, std::span<const MovedSector> sectors) {
  expect_radius(partition, state.radius_max);
  for (const BodyRecord& record : state.statics) add_body(partition, record);
  for (const JointTie& tie : state.joints) take_tie(partition, tie);
  hear(partition, state);
  for (const MovedSector& sector : sectors) {
    if (!partition.hosts(sector.sector)) continue;
    unpack_sector(partition, sector);
    if (sector.active) continue;
    if (const auto found = partition.sectors.find(sector.sector); found != partition.sectors.end()) {
      found->second->active = false;
      note_rest(partition, *found->second);
    }
  }
  std::erase_if(partition.active, [](const Sector* sector) { return !sector->active; });
}

}  // namespace tessera
