#include "lpss/tick/report.h"

#include <atomic>

namespace tessera {

void count(const Partition& partition, const std::vector<Sector*>& stepped, const ParallelFor& parallel,
           TickCounts& counts) {
  counts.sectors = partition.world_count + partition.packed.counts().worlds;
  counts.sectors_awake = stepped.size();
  counts.clones = partition.clone_count;
  std::atomic<std::uint64_t> contacts = 0;
  std::atomic<std::uint64_t> awake = 0;
  run_parallel(parallel, stepped.size(), [&](std::size_t i) {
    const Sector& sector = *stepped[i];
    contacts += sector.world->contacts().size();
    const Pieces pieces(sector.homes.size(), kBodiesInPiece);
    run_parallel(parallel, pieces.count(), [&](std::size_t piece) {
      std::uint64_t some = 0;
      for (std::size_t n = pieces.begin(piece); n < pieces.end(piece); ++n)
        some += sector.world->activity(sector.homes[n]->slot) != Activity::kAsleep ? 1 : 0;
      awake += some;
    });
  });
  counts.contacts += contacts;
  counts.bodies_awake += awake;
}

}  // namespace tessera
