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
  if (partition.settings.seams == SeamPolicy::kClone) {
    for (HomeBody* body : sector.homes) attend(*body);
  }
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

// Policy clone, depth k > 1: what touches a body that is cloned is cloned with it, k - 1 contacts deep.
void deepen_clones(int depth_max, Sector& sector) {
  if (!sector.world) return;
  const auto place_of = [&](BodyId id) -> std::optional<std::size_t> {
    const auto place =
        std::lower_bound(sector.homes.begin(), sector.homes.end(), id,
                         [](const HomeBody* body, BodyId wanted) { return body->id < wanted; });
    if (place == sector.homes.end() || (*place)->id != id) return std::nullopt;
    return static_cast<std::size_t>(place - sector.homes.begin());
  };
  std::vector<OffsetSet> reached(sector.homes.size());
  for (int depth = 1; depth < depth_max; ++depth) {
    for (std::size_t n = 0; n < sector.homes.size(); ++n) reached[n] = sector.homes[n]->wanted_in;
    for (const ContactPair& pair : sector.world->contacts()) {
      const auto a = place_of(pair.a);
      const auto b = place_of(pair.b);
      if (!a || !b) continue;
      sector.homes[*a]->wanted_in.merge(reached[*b]);
      sector.homes[*b]->wanted_in.merge(reached[*a]);
    }
  }
}

}  // namespace

OffsetSet sectors_to_tell(const Partition& partition, const Eigen::AlignedBox3d& swept,
                          const Eigen::Vector3d& velocity, double surge, Motion motion) {
  const WorldSettings& settings = partition.settings;
  if (settings.seams == SeamPolicy::kClone && settings.clone_depth == 0) return {};
  const Eigen::Vector3d way = velocity * partition.dt();
  const bool goes_fast = is_fast(way, partition.margins, surge);
  OffsetSet reached = sectors_within_reach(swept, way, partition.margins);
  if (goes_fast && motion == Motion::kDynamic && settings.seams == SeamPolicy::kIsland) {
    reached.merge(homes_of_slower(swept, way, partition.margins, surge));
  }
  return clone_targets(reached, settings.seams, motion, goes_fast);
}

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
      body->wanted_in = sectors_to_tell(partition, body->swept, sector.world->linear_velocity(body->slot),
                                        sector.world->surge(body->slot), body->properties.motion);
    }
  });
  const WorldSettings& settings = partition.settings;
  if (settings.seams == SeamPolicy::kClone && settings.clone_depth > 1) {
    for (Sector* sector : partition.active) deepen_clones(settings.clone_depth, *sector);
  }
}

}  // namespace tessera
