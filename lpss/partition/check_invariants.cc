// What holds of a partition between ticks.
#include <algorithm>
#include <functional>

#include "lpss/base/invariant.h"
#include "lpss/partition/joints.h"
#include "lpss/partition/partition.h"

namespace tessera {
namespace {

template <typename T>
bool has_each_once(std::vector<T> items) {
  std::sort(items.begin(), items.end());
  return std::adjacent_find(items.begin(), items.end()) == items.end();
}

void check_bodies(const Partition& partition, const Sector& sector) {
  invariant(std::is_sorted(sector.homes.begin(), sector.homes.end(),
                           [](const HomeBody* a, const HomeBody* b) { return a->id < b->id; }),
            "a sector lists its bodies in the order of their ids");
  for (const HomeBody* body : sector.homes) {
    const auto known = partition.bodies.find(body->id);
    invariant(known != partition.bodies.end() && known->second.get() == body,
              "a sector lists bodies of its partition");
    invariant(body->sector == &sector, "a body knows the sector that lists it");
    invariant(
        body->programs.empty() != std::ranges::binary_search(sector.programmed, body->id, {}, &HomeBody::id),
        "a sector lists its bodies with programs");
    invariant(body->jointed == !partition.joints.of(body->id).empty(), "a body knows whether joints hold it");
    invariant(body->jointed == partition.jointed.contains(body->id), "a partition lists bodies with joints");
    const bool leaves =
        std::find(partition.leaving.begin(), partition.leaving.end(), body->id) != partition.leaving.end();
    invariant(leaves == body->next_home.has_value(), "a body that changes home is listed as leaving");
  }
}

// What is known of joints is what need be known (joints.h).
void check_joints(const Partition& partition) {
  const JointIndex& joints = partition.joints;
  joints.for_each([&](const JointTie& tie) {
    const bool has_child = partition.bodies.contains(tie.child);
    const std::span<const JointId> coupled = joints.coupled(tie.id);
    const auto has_record = [&](JointId id) { return joints.record(id) != nullptr; };
    invariant(has_child == has_record(tie.id), "the record of a joint is where its child lives");
    invariant(has_child || partition.bodies.contains(tie.parent) || all_know_joints(partition.settings) ||
                  std::ranges::any_of(coupled, has_record),
              "a joint is known where a body of it lives, or one that is coupled with it");
    for (const JointAxis& axis :
         has_child ? axes_of(joints.record(tie.id)->properties) : std::span<const JointAxis>()) {
      invariant(!axis.mimic.is_set() || joints.find(axis.mimic.leader) != nullptr,
                "what a joint follows is known with it");
    }
  });
}

void check_clones(const Partition& partition, const Sector& sector) {
  std::vector<const Clone*> placed;
  for (const auto& [id, clone] : sector.clones) {
    const auto replica = partition.replicas.find(id);
    invariant(replica != partition.replicas.end() && replica->second.get() == clone->replica,
              "a clone copies a replica of its partition");
    invariant(clone->sector == &sector, "a clone knows the sector that lists it");
    if (clone->is_placed()) placed.push_back(clone);
  }
  invariant(std::equal(placed.begin(), placed.end(), sector.placed.begin(), sector.placed.end()),
            "a sector lists the clones in its engine world in the order of their ids");
}

void check_sector(const Partition& partition, const SectorIndex& index, const Sector& sector) {
  invariant(sector.index == index, "a sector is found under its index");
  invariant(partition.hosts(index), "a partition has only sectors that the map gives to it");
  invariant(!sector.homes.empty() || sector.active || !sector.clones.empty(),
            "a sector without bodies and clones is gone, or about to be");
  invariant(sector.world || sector.homes.empty(), "a sector in which a body lives has an engine world");
  const bool listed =
      std::find(partition.active.begin(), partition.active.end(), &sector) != partition.active.end();
  invariant(listed == sector.active, "an active sector is on the list");
  invariant(sector.world || sector.overlaps.empty(), "what is in triggers is known where bodies live");
  invariant(
      std::ranges::adjacent_find(sector.overlaps, std::ranges::greater_equal()) == sector.overlaps.end(),
      "a sector lists once, in their order, who is in which trigger");
  check_bodies(partition, sector);
  check_clones(partition, sector);
}

}  // namespace

void check_invariants(const Partition& partition) {
  std::size_t homes = 0;
  std::size_t worlds = 0;
  std::size_t programmed = 0;
  for (const auto& [index, sector] : partition.sectors) {
    check_sector(partition, index, *sector);
    homes += sector->homes.size();
    programmed += sector->programmed.size();
    worlds += sector->world ? 1 : 0;
  }
  invariant(homes == partition.bodies.size(), "each body lives in one sector");
  invariant(programmed == partition.programmed_count, "a partition counts its bodies with programs");
  invariant(worlds == partition.world_count, "a partition counts its engine worlds");
  for (const SectorIndex& index : partition.packed.sectors()) {
    invariant(partition.hosts(index), "a partition has only packed sectors that the map gives to it");
    invariant(!partition.sectors.contains(index), "a sector is packed, or it is not");
    partition.packed.for_each_body(index, [&](const BodyRecord& record) {
      invariant(!partition.bodies.contains(record.id), "each body lives in one sector, packed or not");
    });
  }
  if (partition.left_joints.empty()) check_joints(partition);
  invariant(has_each_once(partition.active), "a sector is active once");
  invariant(has_each_once(partition.leaving), "a body leaves once");
  for (const BodyId id : partition.leaving) {
    invariant(partition.bodies.contains(id), "a body that leaves lives here");
  }
  for (const auto& [id, replica] : partition.replicas) {
    invariant(replica->id == id, "a replica is found under its id");
    for (const std::unique_ptr<Clone>& clone : replica->clones) {
      const auto listed = clone->sector->clones.find(id);
      invariant(listed != clone->sector->clones.end() && listed->second == clone.get(),
                "a replica has the clones that sectors list");
    }
  }
  for (const BodyId id : partition.moving_replicas) {
    invariant(partition.replicas.contains(id), "a replica that moves is known");
  }
}

}  // namespace tessera
