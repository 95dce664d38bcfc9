#include "lpss/partition/moved_sector.h"

#include <algorithm>

#include "lpss/partition/bodies.h"
#include "lpss/partition/joints.h"
#include "lpss/partition/replicas.h"
#include "lpss/partition/sectors.h"

namespace tessera {
namespace {

void unpack_bodies(Partition& partition, const MovedSector& moved) {
  if (!moved.bodies.empty()) {
    make_world(
        partition, sector_at(partition, moved.sector),
        {Eigen::Vector3d(moved.static_region.data()), Eigen::Vector3d(moved.static_region.data() + 3)});
  }
  for (const MovedBody& body : moved.bodies) {
    take_joints(partition, body.joints);
    HomeBody& home = add_home(partition, body.record);
    home.replicated_in = body.replicated_in;
    home.wanted_in = body.replicated_in;  // one that sleeps is not looked at again
    home.known_everywhere = body.known_everywhere;
    home.next_home = body.next_home;
    home.kinematic_target = body.kinematic_target;
    home.dirty = body.dirty;
    attend(home);
    if (home.next_home) partition.leaving.push_back(home.id);
  }
}

void unpack_clones(Partition& partition, const MovedSector& moved) {
  for (const MovedClone& from : moved.clones) {
    Replica& replica = introduce(partition, from.introduction);
    revise(replica, from.update);
    note_moving(partition, replica);
    Clone& clone = clone_in(partition, replica, moved.sector);
    clone.home = metres_between(moved.sector, replica.home, partition.sector_size());
    if (from.placed) place_clone(partition, clone);
    clone.fresh = from.fresh;
  }
}

void unpack_contacts(Partition& partition, const MovedSector& moved) {
  const auto found = partition.sectors.find(moved.sector);
  if (found == partition.sectors.end() || !found->second->world) return;
  Sector& sector = *found->second;
  for (const ManifoldState& manifold : moved.manifolds) sector.world->import_manifold(manifold);
  sector.touching.insert(moved.touching.begin(), moved.touching.end());
  sector.overlaps = moved.overlaps;
  sector.parts_reported = moved.parts_reported;
}

}  // namespace

MovedSector pack_sector(const Partition& partition, const Sector& sector) {
  MovedSector moved;
  moved.sector = sector.index;
  moved.active = sector.active;
  for (const HomeBody* body : sector.homes) {
    moved.bodies.push_back({record_of(*body), body->replicated_in, body->known_everywhere, body->next_home,
                            body->kinematic_target, body->dirty,
                            body->jointed ? joints_of(partition, body->id) : BodyJoints{}});
  }
  for (const auto& [id, clone] : sector.clones) {
    const Replica& replica = *clone->replica;
    moved.clones.push_back({introduction_of(replica), update_of(replica), clone->is_placed(), clone->fresh});
  }
  if (!sector.world) return moved;
  const std::span<const ContactPair> pairs = sector.world->contacts();
  for (std::size_t i = 0; i < pairs.size(); ++i) moved.manifolds.push_back(sector.world->export_manifold(i));
  moved.touching.assign(sector.touching.begin(), sector.touching.end());
  std::sort(moved.touching.begin(), moved.touching.end());
  moved.overlaps = sector.overlaps;
  Eigen::Map<Eigen::Vector3d>(moved.static_region.data()) = sector.static_region.min();
  Eigen::Map<Eigen::Vector3d>(moved.static_region.data() + 3) = sector.static_region.max();
  moved.parts_reported = sector.parts_reported;
  return moved;
}

MovedSector with_parts(const Partition& partition, MovedSector sector) {
  for (const SeamPart& part : partition.seam_graph.parts_of(sector.sector)) sector.parts.push_back(part.said);
  return sector;
}

void forget_sector(Partition& partition, Sector& sector) {
  for (const HomeBody* body : sector.homes) {
    std::erase(partition.leaving, body->id);
    if (partition.jointed.erase(body->id) > 0) leave_joints(partition, body->id);
    partition.bodies.erase(BodyId(body->id));
  }
  partition.programmed_count -= sector.programmed.size();
  for (const auto& [id, clone] : sector.clones) {
    Replica& replica = *clone->replica;
    std::erase_if(replica.clones,
                  [&](const std::unique_ptr<Clone>& other) { return other->sector == &sector; });
    if (replica.clones.empty() && !replica.known_everywhere) {
      std::erase(partition.moving_replicas, id);
      partition.replicas.erase(BodyId(id));
    }
  }
  if (sector.world) --partition.world_count;
  partition.clone_count -= sector.clones_counted;
  if (sector.active) std::erase(partition.active, &sector);
  partition.sectors.erase(SectorIndex(sector.index));
}

void unpack_sector(Partition& partition, const MovedSector& moved) {
  unpack_bodies(partition, moved);
  unpack_clones(partition, moved);
  unpack_contacts(partition, moved);
  if (!moved.parts.empty()) partition.seam_graph.replace({moved.sector, moved.parts});
}

}  // namespace tessera
