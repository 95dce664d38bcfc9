#include "lpss/observe/passing_worlds.h"

#include <algorithm>
#include <vector>

#include "lpss/partition/statics.h"

namespace tessera {
namespace {

bool is_any_in(const Partition& partition, const SectorIndex& index, const Eigen::AlignedBox3d& region) {
  const std::vector<BodyId> statics = partition.statics.overlapping(index, region);
  return std::any_of(statics.begin(), statics.end(), [&](BodyId id) {
    const StaticIndex::Cut cut = partition.statics.cut(id, index, region);
    return cut.whole || !cut.shape.parts.empty();
  });
}

}  // namespace

Eigen::AlignedBox3d surroundings(const Partition& partition) {
  return cube(partition.sector_size() / 2 + partition.margins.reach);
}

void PassingWorlds::make_room() {
  if (entries_.size() < kPassingWorldsMax) return;
  entries_.erase(
      std::ranges::min_element(entries_, {}, [](const auto& named) { return named.second->asked; }));
}

const SectorWorld* PassingWorlds::at(const Partition& partition, const SectorIndex& index,
                                     const Eigen::AlignedBox3d& region) {
  if (revision_ != partition.statics.revision()) entries_.clear();
  revision_ = partition.statics.revision();
  auto found = entries_.find(index);
  if (found == entries_.end()) {
    if (!is_any_in(partition, index, region.intersection(surroundings(partition)))) return nullptr;
    make_room();
    found = entries_.emplace(index, std::make_unique<Entry>()).first;
    found->second->sector.index = index;
    found->second->sector.world = partition.engine.make_world();
  }
  found->second->asked = ++calls_;
  add_statics(partition, found->second->sector, surroundings(partition));
  return found->second->sector.world.get();
}

}  // namespace tessera
