// What happens at seams, for those who watch.
#include <algorithm>
#include <tuple>

#include "lpss/tick/share.h"

namespace tessera {

std::vector<Share::CloneAt> Share::clones() const {
  std::vector<CloneAt> found;
  for (const auto& [index, sector] : sectors_) {
    for (const auto& [id, clone] : sector->clones) {
      if (clone.slot == Clone::kNotPlaced) continue;
      found.push_back({id, {index, sector->world->position(clone.slot)}});
    }
  }
  std::sort(found.begin(), found.end(), [](const CloneAt& a, const CloneAt& b) {
    return std::tie(a.body, a.position.sector) < std::tie(b.body, b.position.sector);
  });
  return found;
}

std::vector<Share::IslandHere> Share::islands_across_seams() const {
  std::vector<SectorIndex> awake;
  for (const auto& [index, sector] : sectors_) {
    if (sector->world && !sector->regroup && anything_awake(*sector)) awake.push_back(index);
  }
  std::vector<IslandHere> found;
  for (const SeamIsland& island : seam_graph_.awake_islands(awake)) {
    if (island.parts.size() < 2) continue;
    IslandHere here{island.name, {}};
    for (const PartRef& part : island.parts) {
      const auto place = sectors_.find(part.sector);
      if (place == sectors_.end() || place->second->regroup) continue;
      const Sector& sector = *place->second;
      const Component& component = sector.components[sector.part_components[part.part]];
      for (std::uint32_t i = component.bodies_begin; i < component.bodies_end; ++i) {
        here.bodies.push_back(sector.component_bodies[i]->id);
      }
    }
    std::sort(here.bodies.begin(), here.bodies.end());
    found.push_back(std::move(here));
  }
  return found;
}

}  // namespace tessera
