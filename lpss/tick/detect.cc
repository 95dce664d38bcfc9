#include "lpss/tick/detect.h"

#include "lpss/partition/sectors.h"
#include "lpss/tick/frames.h"

namespace tessera {

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
    feel(partition, *stepped[i], parallel);
    stepped[i]->world->detect(partition.dt(), parallel);
  });
  return stepped;
}

}  // namespace tessera
