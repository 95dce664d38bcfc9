#include "lpss/observe/contacts.h"

#include <absl/container/btree_set.h>

#include <algorithm>
#include <tuple>
#include <utility>

#include "lpss/partition/packing.h"

namespace tessera {
namespace {

void bring_back_contacts_of(Partition& partition, BodyId body) {
  if (partition.statics.find(body) != nullptr) {
    bring_back_touching(partition, body);
  } else {
    bring_back_holding(partition, body);
  }
}

// Those in which contacts of the body are detected: where it lives, or a clone of it is.
void add_sectors(const Partition& partition, BodyId body, absl::btree_set<SectorIndex>& sectors) {
  if (partition.statics.find(body) != nullptr) {
    for (const auto& [index, sector] : partition.sectors) {
      if (sector->statics.contains(body)) sectors.insert(index);
    }
    return;
  }
  if (const auto home = partition.bodies.find(body); home != partition.bodies.end())
    sectors.insert(home->second->sector->index);
  const auto replica = partition.replicas.find(body);
  if (replica == partition.replicas.end()) return;
  for (const std::unique_ptr<Clone>& clone : replica->second->clones) {
    if (clone->is_placed()) sectors.insert(clone->sector->index);
  }
}

void append_patches(const Partition& partition, const Sector& sector, std::span<const BodyId> bodies,
                    std::vector<TouchingPatch>& patches) {
  if (!sector.world) return;
  const auto is_asked = [&](BodyId id) { return std::binary_search(bodies.begin(), bodies.end(), id); };
  const std::span<const ContactPair> pairs = sector.world->contacts();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const ContactPair& pair = pairs[i];
    if (!is_asked(pair.a) && !is_asked(pair.b)) continue;
    if (!partition.rules.reports(partition, sector, pair)) continue;
    for (ContactDetail& detail : sector.world->touching_patches(i))
      patches.push_back({patch_of(partition, sector, std::move(detail)), pair.a, pair.b});
  }
}

}  // namespace

std::vector<TouchingPatch> contacts_of(Partition& partition, std::span<const BodyId> bodies) {
  for (const BodyId body : bodies) bring_back_contacts_of(partition, body);
  absl::btree_set<SectorIndex> sectors;
  for (const BodyId body : bodies) add_sectors(partition, body, sectors);
  std::vector<TouchingPatch> patches;
  for (const SectorIndex& index : sectors)
    append_patches(partition, *partition.sectors.at(index), bodies, patches);
  std::ranges::stable_sort(patches, {},
                           [](const TouchingPatch& patch) { return std::pair(patch.a, patch.b); });
  return patches;
}

}  // namespace tessera
