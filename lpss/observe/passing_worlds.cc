#include "lpss/observe/passing_worlds.h"

#include <algorithm>
#include <vector>

#include "lpss/partition/statics.h"

namespace tessera {
namespace {

// So often it pays to look at what little of the static bodies a query needs, in the place of making a world.
constexpr int kMissesMax = 16;

bool is_any_in(const Partition& partition, const SectorIndex& index, const Eigen::AlignedBox3d& region,
               bool roughly) {
  const std::vector<BodyId> statics = partition.statics.overlapping(index, region);
  return std::any_of(statics.begin(), statics.end(), [&](BodyId id) {
    if (roughly) return true;
    const StaticIndex::Cut cut = partition.statics.cut(id, index, region);
    return cut.whole || !cut.shape.parts.empty();
  });
}

}  // namespace

Eigen::AlignedBox3d surroundings(const Partition& partition) {
  return cube(partition.sector_size() / 2 + partition.margins.reach);
}

const SectorWorld* PassingWorlds::at(const Partition& partition, const SectorIndex& index,
                                     const Eigen::AlignedBox3d& region) {
  if (revision_ != partition.statics.revision()) entries_.clear();
  revision_ = partition.statics.revision();
  const auto found = entries_.find(index);
  if (found != entries_.end() && found->second->sector.world) {
    add_statics(partition, found->second->sector, surroundings(partition));
    return found->second->sector.world.get();
  }
  const bool roughly = found != entries_.end() && found->second->misses >= kMissesMax;
  const bool is_any = is_any_in(partition, index, region, roughly);
  if (!is_any && partition.statics.overlapping(index, region).empty()) return nullptr;
  if (found == entries_.end() && entries_.size() >= kPassingWorldsMax) entries_.clear();
  std::unique_ptr<Entry>& entry = entries_[index];
  if (!entry) entry = std::make_unique<Entry>();
  if (!is_any) {
    ++entry->misses;
    return nullptr;
  }
  entry->sector.index = index;
  entry->sector.world = partition.engine.make_world();
  add_statics(partition, entry->sector, surroundings(partition));
  return entry->sector.world.get();
}

}  // namespace tessera
