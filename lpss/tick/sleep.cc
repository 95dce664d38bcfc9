#include "lpss/tick/sleep.h"

#include <algorithm>

#include "lpss/partition/bodies.h"
#include "lpss/partition/packing.h"
#include "lpss/tick/programs.h"

namespace tessera {
namespace {

void rest(Sector& sector) {
  sector.components.shrink_to_fit();
  sector.component_bodies.shrink_to_fit();
  sector.component_pairs.shrink_to_fit();
  sector.in_free_flight = {};
  if (sector.world) sector.world->rest();
}

}  // namespace

void settle(Partition& partition, TickContext& context, Sector& sector, Component& component,
            bool all_want_sleep) {
  if (!all_want_sleep && !component.any_asleep) return;
  component.any_asleep = all_want_sleep;
  SectorWorld& world = *sector.world;
  for (std::uint32_t i = component.bodies_begin; i < component.bodies_end; ++i) {
    HomeBody& body = *sector.component_bodies[i];
    const Activity activity = world.activity(body.slot);
    if (all_want_sleep && activity != Activity::kAsleep) {
      world.sleep(body.slot);
      mark_dirty(body);
    } else if (!all_want_sleep && activity == Activity::kAsleep) {
      world.wake(body.slot);
      if (sector.awake) continue;
      sector.awake = true;
      context.stepped.push_back(&sector);
      activate(partition, sector);
    }
  }
}

void retire_sectors(Partition& partition) {
  std::erase_if(partition.active, [&](Sector* sector) {
    const bool dirty = std::any_of(sector->attended.begin(), sector->attended.end(),
                                   [](const HomeBody* body) { return body->dirty || body->next_home; });
    sector->active = dirty || (sector->world && anything_awake(*sector)) || awaits_programs(*sector);
    if (!sector->active) {
      rest(*sector);
      note_rest(partition, *sector);
    }
    return !sector->active;
  });
}

}  // namespace tessera
