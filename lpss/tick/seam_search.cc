#include "lpss/tick/seam_search.h"

#include <algorithm>

#include "lpss/partition/bodies.h"

namespace tessera {
namespace {

// m, so that a body inside by this is inside by any rounding.
constexpr double kBorderRounding = 1e-3;

// `inside`: of the sector, what needs nobody.
void attend_borders(const Partition& partition, const Eigen::AlignedBox3d& inside, Sector& sector,
                    const ParallelFor& parallel) {
  // Those that others know of stay.
  std::erase_if(sector.attended, [](HomeBody* body) {
    body->attended = body->dirty || !body->replicated_in.empty() || body->known_everywhere;
    return !body->attended;
  });
  partition.rules.attend_inside(sector);
  for (HomeBody* body : sector.attended) body->may_have_moved = false;
  std::vector<BodyOutside> outside;
  sector.world->append_outside(inside, partition.dt(), outside, parallel);
  for (const BodyOutside& found : outside) {
    HomeBody& body = *sector.by_slot[static_cast<std::size_t>(found.slot)];
    attend(body);
    body.may_have_moved = true;
    body.swept = found.swept;
  }
  for (HomeBody* body : sector.attended) {
    if (body->may_have_moved) continue;
    body->may_have_moved = body->dirty || sector.world->activity(body->slot) != Activity::kAsleep;
    if (body->may_have_moved) body->swept = sector.world->swept_box(body->slot, partition.dt());
  }
  const auto by_id = [](const HomeBody* a, const HomeBody* b) { return a->id < b->id; };
  if (!std::is_sorted(sector.attended.begin(), sector.attended.end(), by_id))
    std::sort(sector.attended.begin(), sector.attended.end(), by_id);
}

}  // namespace

void attend_borders(Partition& partition, const ParallelFor& parallel) {
  const Eigen::Vector3d half =
      Eigen::Vector3d::Constant(partition.sector_size() / 2 - partition.margins.reach - kBorderRounding);
  const Eigen::AlignedBox3d inside(-half, half);
  run_in_pieces(parallel, partition.active.size(), kSectorsInPiece, [&](std::size_t n) {
    if (partition.active[n]->world) attend_borders(partition, inside, *partition.active[n], parallel);
  });
}

void search_seams(Partition& partition, const ParallelFor& parallel) {
  run_in_pieces(parallel, partition.active.size(), kSectorsInPiece, [&](std::size_t n) {
    const Sector& sector = *partition.active[n];
    for (HomeBody* body : sector.attended) {
      if (!body->may_have_moved) continue;
      body->wanted_in =
          partition.rules.sectors_to_tell(partition, body->swept, sector.world->linear_velocity(body->slot),
                                          sector.world->surge(body->slot), body->properties.motion);
    }
  });
  partition.rules.extend_search(partition);
}

}  // namespace tessera
