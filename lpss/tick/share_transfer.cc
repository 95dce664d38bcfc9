// Sectors that change servers: all of a sector is packed, and goes on elsewhere as if nothing had happened.
#include <algorithm>

#include "lpss/base/invariant.h"
#include "lpss/model/gravity.h"
#include "lpss/tick/share.h"

namespace tessera {
namespace {

// Of ticks, one in this many moves sectors while authority is shuffled.
constexpr std::uint64_t kShufflePeriod = 3;

void add_sorted(std::vector<SectorIndex>& places, const SectorIndex& place) {
  const auto at = std::lower_bound(places.begin(), places.end(), place);
  if (at == places.end() || *at != place) places.insert(at, place);
}

}  // namespace

bool Share::shuffles() const {
  const std::uint64_t seed = options_.settings.shuffle;
  return seed != 0 && scrambled(seed ^ scrambled(tick_)) % kShufflePeriod == 0;
}

// The sectors that the next map gives to others. Every share draws the same map.
std::vector<Transfer> Share::give_sectors_away() {
  const std::uint64_t seed = scrambled(options_.settings.shuffle + tick_);
  options_.map =
      SectorMap::scattered(options_.anchor, options_.map.servers(), seed, options_.map.epoch() + 1);
  std::vector<Sector*> leaving;
  for (const auto& [index, sector] : sectors_) {
    if (!mine(index)) leaving.push_back(sector.get());
  }
  std::sort(leaving.begin(), leaving.end(),
            [](const Sector* a, const Sector* b) { return a->index < b->index; });
  std::vector<Transfer> outbox(options_.map.servers());
  for (const Sector* sector : leaving) {
    outbox[options_.map.owner(sector->index)].sectors.push_back(pack_sector(*sector));
  }
  for (Sector* sector : leaving) forget_sector(*sector);
  return outbox;
}

MovedSector Share::pack_sector(const Sector& sector) const {
  MovedSector moved;
  moved.sector = sector.index;
  for (const HomeBody* body : sector.homes) {
    moved.bodies.push_back(
        {record_of(*body), body->targets, body->everywhere, body->next_home, body->goal, body->news});
  }
  for (const auto& [id, clone] : sector.clones) {
    const Ghost& ghost = *clone.ghost;
    moved.clones.push_back({{id, ghost.properties},
                            {id, ghost.home, ghost.next_home, ghost.targets, ghost.state},
                            clone.slot != Clone::kNotPlaced,
                            clone.fresh});
  }
  if (!sector.world) return moved;
  const std::span<const ContactPair> pairs = sector.world->contacts();
  for (std::size_t i = 0; i < pairs.size(); ++i) moved.manifolds.push_back(sector.world->export_manifold(i));
  moved.touching.assign(sector.touching.begin(), sector.touching.end());
  std::sort(moved.touching.begin(), moved.touching.end());
  Eigen::Map<Eigen::Vector3d>(moved.static_region.data()) = sector.static_region.min();
  Eigen::Map<Eigen::Vector3d>(moved.static_region.data() + 3) = sector.static_region.max();
  moved.parts_known = sector.parts_known;
  return moved;
}

void Share::forget_sector(Sector& sector) {
  for (const HomeBody* body : sector.homes) {
    std::erase(leaving_, body->id);
    bodies_.erase(BodyId(body->id));
  }
  for (const auto& [id, clone] : sector.clones) {
    std::erase(clone.ghost->places, sector.index);
    // What all shares know stays known.
    const bool everywhere = clone.ghost->properties.motion == Motion::kKinematic && !joints_.of(id).empty();
    if (clone.ghost->places.empty() && !everywhere) {
      std::erase(moving_ghosts_, id);
      ghosts_.erase(BodyId(id));
    }
  }
  if (sector.world) --worlds_;
  clones_ -= sector.counted;
  if (sector.active) std::erase(active_, &sector);
  sectors_.erase(SectorIndex(sector.index));
}

void Share::take_sectors(std::vector<Transfer> inbox) {
  std::vector<const MovedSector*> arriving;
  for (const Transfer& message : inbox) {
    for (const MovedSector& moved : message.sectors) arriving.push_back(&moved);
  }
  std::sort(arriving.begin(), arriving.end(),
            [](const MovedSector* a, const MovedSector* b) { return a->sector < b->sector; });
  for (const MovedSector* moved : arriving) {
    unpack_bodies(*moved);
    unpack_clones(*moved);
    unpack_contacts(*moved);
  }
}

void Share::unpack_bodies(const MovedSector& moved) {
  for (const MovedBody& body : moved.bodies) {
    HomeBody& home = add_home(body.record);
    home.targets = body.targets;
    home.near = body.targets;  // one that sleeps is not looked at again
    home.everywhere = body.everywhere;
    home.next_home = body.next_home;
    home.goal = body.goal;
    home.news = body.news;
    if (home.next_home) leaving_.push_back(home.id);
  }
}

void Share::unpack_clones(const MovedSector& moved) {
  if (moved.clones.empty()) return;
  Sector& sector = sector_at(moved.sector);
  for (const MovedClone& clone : moved.clones) {
    Ghost& ghost = introduce(clone.introduction);
    revise(ghost, clone.update);
    add_sorted(ghost.places, moved.sector);
    if (ghost.next_home != ghost.home &&
        std::find(moving_ghosts_.begin(), moving_ghosts_.end(), ghost.id) == moving_ghosts_.end()) {
      moving_ghosts_.push_back(ghost.id);
    }
    Clone& entry = sector.clones[ghost.id];
    entry.ghost = &ghost;
    if (clone.placed) place_clone(sector, entry);
    entry.fresh = clone.fresh;
  }
}

void Share::unpack_contacts(const MovedSector& moved) {
  const auto found = sectors_.find(moved.sector);
  if (found == sectors_.end() || !found->second->world) return;
  Sector& sector = *found->second;
  add_statics(sector,
              {Eigen::Vector3d(moved.static_region.data()), Eigen::Vector3d(moved.static_region.data() + 3)});
  for (const ManifoldState& manifold : moved.manifolds) sector.world->import_manifold(manifold);
  sector.touching.insert(moved.touching.begin(), moved.touching.end());
  sector.parts_known = moved.parts_known;
}

}  // namespace tessera
