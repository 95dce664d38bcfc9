#include "lpss/tick/cloning.h"

#include <algorithm>

#include "lpss/partition/bodies.h"
#include "lpss/partition/near_seam.h"
#include "lpss/partition/replicas.h"
#include "lpss/partition/statics.h"

namespace tessera {
namespace {

// Statics beyond the usual surroundings of a sector, for bodies that go far in one tick.
void reach_statics(Partition& partition, Sector& sector) {
  for (const HomeBody* body : sector.attended) {
    if (sector.world->activity(body->slot) != Activity::kAsleep) add_statics(partition, sector, body->swept);
  }
}

void set_ranges(const Partition& partition, Sector& sector) {
  for (const HomeBody* body : sector.attended) {
    if (body->properties.motion != Motion::kDynamic) continue;
    const Eigen::Vector3d way = sector.world->linear_velocity(body->slot) * partition.dt();
    const bool goes_fast =
        !body->replicated_in.empty() && is_fast(way, partition.margins, sector.world->surge(body->slot));
    sector.world->set_range(body->slot, goes_fast ? Range::kFast : Range::kUsual);
  }
}

Eigen::AlignedBox3d swept_ball_of(const Clone& clone, double dt) {
  constexpr double kContactMargin = 0.05;  // m, beyond the distance at which engines keep contact points
  const Replica& replica = *clone.replica;
  return swept_ball(Eigen::Vector3d(replica.state.position.data()) + clone.home,
                    Eigen::Vector3d(replica.state.linear_velocity.data()),
                    replica.radius + replica.surge + kContactMargin, dt);
}

void refresh_clones(Partition& partition, Sector& sector) {
  if (sector.homes.empty()) return;
  SectorWorld& world = *sector.world;
  for (const auto& [id, clone] : sector.clones) {
    if (clone->is_placed() && !clone->fresh) continue;
    const bool imminent = partition.rules.needs_clone(partition, id, sector) ||
                          world.reaches_home_body(swept_ball_of(*clone, partition.dt()), clone->near);
    if (!imminent) {
      if (clone->is_placed()) remove_clone(*clone);
      continue;
    }
    if (!clone->is_placed()) {
      place_clone(partition, *clone);
    } else {
      world.set_state(clone->slot, state_of(*clone));
      foresee_clone(partition, *clone);
    }
    clone->fresh = false;
  }
}

}  // namespace

void update_clones(Partition& partition, const ParallelFor& parallel) {
  run_parallel(parallel, partition.active.size(), [&](std::size_t i) {
    Sector& sector = *partition.active[i];
    if (!sector.world) return;
    reach_statics(partition, sector);
    set_ranges(partition, sector);
    refresh_clones(partition, sector);
  });
}

}  // namespace tessera
