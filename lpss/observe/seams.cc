#include "lpss/observe/seams.h"

#include <algorithm>
#include <tuple>

#include "lpss/partition/sectors.h"

namespace tessera {

std::vector<CloneAt> clones_of(const Partition& partition) {
  std::vector<CloneAt> found;
  for (const auto& [index, sector] : partition.sectors) {
    for (const Clone* clone : sector->placed) {
      found.push_back({clone->replica->id, {index, sector->world->position(clone->slot)}});
    }
  }
  std::sort(found.begin(), found.end(), [](const CloneAt& a, const CloneAt& b) {
    return std::tie(a.body, a.position.sector) < std::tie(b.body, b.position.sector);
  });
  return found;
}

std::vector<IslandHere> islands_across_seams(const Partition& partition) {
  std::vector<SectorIndex> awake;
  for (const auto& [index, sector] : partition.sectors) {
    if (sector->world && !sector->components_stale && anything_awake(*sector)) awake.push_back(index);
  }
  std::vector<IslandHere> found;
  for (const SeamIsland& island : partition.seam_graph.awake_islands(awake)) {
    if (island.parts.size() < 2) continue;
    IslandHere here{island.id, {}};
    for (const PartRef& part : island.parts) {
      const auto place = partition.sectors.find(part.sector);
      if (place == partition.sectors.end() || place->second->components_stale) continue;
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
