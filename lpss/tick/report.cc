#include "lpss/tick/report.h"

namespace tessera {

void count(const Partition& partition, const std::vector<Sector*>& stepped, TickCounts& counts) {
  counts.sectors = static_cast<std::uint32_t>(partition.world_count);
  counts.sectors_awake = static_cast<std::uint32_t>(stepped.size());
  counts.clones = static_cast<std::uint32_t>(partition.clone_count);
  for (const Sector* sector : stepped) {
    counts.contacts += static_cast<std::uint32_t>(sector->world->contacts().size());
    for (const HomeBody* body : sector->homes) {
      counts.bodies_awake += sector->world->activity(body->slot) != Activity::kAsleep ? 1 : 0;
    }
  }
}

}  // namespace tessera
