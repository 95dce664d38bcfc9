#include "lpss/tick/report.h"

namespace tessera {

void count(const Partition& partition, const std::vector<Sector*>& stepped, TickCounts& counts) {
  counts.sectors = partition.world_count;
  counts.sectors_awake = stepped.size();
  counts.clones = partition.clone_count;
  for (const Sector* sector : stepped) {
    counts.contacts += sector->world->contacts().size();
    for (const HomeBody* body : sector->homes) {
      counts.bodies_awake += sector->world->activity(body->slot) != Activity::kAsleep ? 1 : 0;
    }
  }
}

}  // namespace tessera
