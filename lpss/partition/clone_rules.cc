#include "lpss/partition/clone_rules.h"

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include "lpss/partition/bodies.h"
#include "lpss/partition/near_seam.h"
#include "lpss/partition/partition.h"

namespace tessera {
namespace {

std::optional<std::size_t> place_of(const Sector& sector, BodyId id) {
  const auto place = std::lower_bound(sector.homes.begin(), sector.homes.end(), id,
                                      [](const HomeBody* body, BodyId wanted) { return body->id < wanted; });
  if (place == sector.homes.end() || (*place)->id != id) return std::nullopt;
  return static_cast<std::size_t>(place - sector.homes.begin());
}

void deepen_clones(int depth_max, Sector& sector) {
  if (!sector.world) return;
  std::vector<OffsetSet> reached(sector.homes.size());
  for (int depth = 1; depth < depth_max; ++depth) {
    for (std::size_t n = 0; n < sector.homes.size(); ++n) reached[n] = sector.homes[n]->wanted_in;
    for (const ContactPair& pair : sector.world->contacts()) {
      const auto a = place_of(sector, pair.a);
      const auto b = place_of(sector, pair.b);
      if (!a || !b) continue;
      sector.homes[*a]->wanted_in.merge(reached[*b]);
      sector.homes[*b]->wanted_in.merge(reached[*a]);
    }
  }
}

}  // namespace

OffsetSet CloneRules::sectors_to_tell(const Partition& partition, const Eigen::AlignedBox3d& swept,
                                      const Eigen::Vector3d& velocity, double /*surge*/,
                                      Motion /*motion*/) const {
  if (partition.settings.clone_depth == 0) return {};
  return sectors_within_reach(swept, velocity * partition.dt(), partition.margins);
}

void CloneRules::attend_inside(Sector& sector) const {
  for (HomeBody* body : sector.homes) attend(*body);
}

void CloneRules::extend_search(Partition& partition) const {
  if (partition.settings.clone_depth <= 1) return;
  for (Sector* sector : partition.active) deepen_clones(partition.settings.clone_depth, *sector);
}

bool CloneRules::needs_clone(const Partition& partition, BodyId id, const Sector& sector) const {
  if (partition.settings.clone_depth > 1) return true;
  return std::ranges::any_of(partition.joints.of(id), [&](JointId joint) {
    return lives_in(partition, partner_of(*partition.joints.find(joint), id), sector);
  });
}

void CloneRules::pull_clone(const Partition& partition, const Clone& clone) const {
  if (!clone.replica->properties.gravity) return;
  SectorWorld& world = *clone.sector->world;
  const SectorIndex& index = clone.sector->index;
  world.set_gravity(clone.slot, partition.felt_in(index).at(index, world.position(clone.slot), true));
}

bool CloneRules::reports(const Partition& partition, const Sector& sector, const ContactPair& pair) const {
  const auto home_of = [&](BodyId id) -> const SectorIndex& {
    if (const auto body = partition.bodies.find(id); body != partition.bodies.end())
      return body->second->sector->index;
    if (const auto replica = partition.replicas.find(id); replica != partition.replicas.end())
      return replica->second->home;
    return sector.index;
  };
  return detecting_sector(motion_of(partition, pair.a), home_of(pair.a), motion_of(partition, pair.b),
                          home_of(pair.b)) == sector.index;
}

}  // namespace tessera
