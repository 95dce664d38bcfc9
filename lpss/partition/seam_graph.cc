#include "lpss/partition/seam_graph.h"

#include <absl/container/flat_hash_set.h>

#include <algorithm>

namespace tessera {

void SeamGraph::unlink(const SectorIndex& sector) {
  const auto old = parts_.find(sector);
  if (old == parts_.end()) return;
  for (const IslandPart& part : old->second) {
    for (const BodyId link : part.links) {
      const auto refs = by_link_.find(link);
      if (refs == by_link_.end()) continue;
      std::erase_if(refs->second, [&](const PartRef& ref) { return ref.sector == sector; });
      if (refs->second.empty()) by_link_.erase(refs);
    }
  }
  parts_.erase(old);
}

void SeamGraph::replace(const SectorSeams& seams) {
  unlink(seams.sector);
  if (seams.parts.empty()) return;
  for (std::uint32_t i = 0; i < seams.parts.size(); ++i) {
    for (const BodyId link : seams.parts[i].links) by_link_[link].push_back({seams.sector, i});
  }
  parts_[seams.sector] = seams.parts;
}

std::vector<SeamIsland> SeamGraph::awake_islands(std::span<const SectorIndex> awake) const {
  std::vector<SeamIsland> islands;
  std::vector<PartRef> queue;
  struct PartRefHash {
    std::size_t operator()(const PartRef& ref) const { return absl::HashOf(ref.sector, ref.part); }
  };
  absl::flat_hash_set<PartRef, PartRefHash> seen;
  for (const SectorIndex& sector : awake) {
    const auto parts = parts_.find(sector);
    if (parts == parts_.end()) continue;
    for (std::uint32_t i = 0; i < parts->second.size(); ++i) {
      if (!parts->second[i].any_awake || !seen.insert({sector, i}).second) continue;
      SeamIsland island;
      queue.push_back({sector, i});
      while (!queue.empty()) {
        const PartRef ref = queue.back();
        queue.pop_back();
        island.parts.push_back(ref);
        const IslandPart& part = this->part(ref);
        island.all_want_sleep &= part.all_want_sleep;
        island.contacts += part.contacts;
        island.substeps = std::max<int>(island.substeps, part.substeps);
        island.bounces |= part.bounces;
        island.is_indivisible |= part.is_indivisible;
        for (const BodyId link : part.links) {
          const auto others = by_link_.find(link);
          if (others == by_link_.end()) continue;
          for (const PartRef& other : others->second) {
            if (seen.insert(other).second) queue.push_back(other);
          }
        }
      }
      std::sort(island.parts.begin(), island.parts.end(), [&](const PartRef& a, const PartRef& b) {
        return this->part(a).first < this->part(b).first;
      });
      island.id = this->part(island.parts.front()).first;
      islands.push_back(std::move(island));
    }
  }
  std::sort(islands.begin(), islands.end(),
            [](const SeamIsland& a, const SeamIsland& b) { return a.id < b.id; });
  return islands;
}

}  // namespace tessera
