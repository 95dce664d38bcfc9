#include "lpss/tick/detect.h"

#include "lpss/partition/sectors.h"
#include "lpss/tick/frames.h"

namespace tessera {
namespace {

// A planet pulls every body in a direction of its own; a uniform pull was set when the body came.
void pull(const Partition& partition, Sector& sector, const ParallelFor& parallel) {
  if (sector.index.frame != kWorldFrame) return feel(partition, sector, parallel);
  if (!std::holds_alternative<CentralGravity>(partition.settings.gravity)) return;
  run_in_pieces(parallel, sector.homes.size(), kBodiesInPiece, [&](std::size_t n) {
    const HomeBody& body = *sector.homes[n];
    if (!body.properties.gravity || sector.world->activity(body.slot) == Activity::kAsleep) return;
    sector.world->set_gravity(
        body.slot, partition.felt_in(sector.index).at(sector.index, sector.world->position(body.slot), true));
  });
}

}  // namespace

std::vector<Sector*> detect(Partition& partition, const ParallelFor& parallel) {
  std::vector<Sector*> stepped;
  for (Sector* sector : partition.active) {
    if (!sector->world) continue;
    partition.clone_count += sector->placed.size() - sector->clones_counted;
    sector->clones_counted = sector->placed.size();
    sector->awake = anything_awake(*sector);
    if (sector->awake) stepped.push_back(sector);
  }
  run_parallel(parallel, stepped.size(), [&](std::size_t i) {
    pull(partition, *stepped[i], parallel);
    stepped[i]->world->detect(partition.dt(), parallel);
  });
  return stepped;
}

}  // namespace tessera
