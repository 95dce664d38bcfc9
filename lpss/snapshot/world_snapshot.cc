#include "lpss/snapshot/world_snapshot.h"

#include <absl/container/flat_hash_map.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "lpss/model/checks.h"
#include "lpss/model/validate.h"
#include "lpss/partition/bodies.h"
#include "lpss/partition/joints.h"
#include "lpss/programs/registry.h"
#include "lpss/snapshot/record_checks.h"
#include "lpss/tick/components.h"

namespace tessera {
namespace {

// What a snapshot says of its world, checked from the shapes up.
class Check {
 public:
  explicit Check(const WorldSnapshot& world)
      : world_(world),
        checks_(world.settings, [&world](ShapeId id) { return find_shape(world.shapes, id); }) {}

  absl::Status all() {
    if (absl::Status status = validate(world_.settings); !status.ok()) return status;
    if (absl::Status status = shapes(); !status.ok()) return status;
    if (absl::Status status = order(); !status.ok()) return status;
    for (const BodyRecord& record : world_.shared.statics) {
      if (absl::Status status = add_static(record); !status.ok()) return in(title_of(record.id), status);
    }
    for (const MovedSector& sector : world_.sectors) {
      if (absl::Status status = bodies(sector); !status.ok()) return status;
    }
    if (absl::Status status = joints(); !status.ok()) return status;
    if (absl::Status status = checks_.acts(world_.shared.acts); !status.ok()) return status;
    for (const KnownReplica& known : world_.shared.known_replicas) {
      if (absl::Status status = replica(known.introduction, known.update); !status.ok()) return status;
    }
    for (const MovedSector& sector : world_.sectors) {
      if (absl::Status status = visitors(sector); !status.ok()) return status;
    }
    return seams();
  }

 private:
  absl::Status shapes() const {
    if (world_.shapes.size() > kShapesMax) {
      return refused("the world's ", world_.shapes.size(), " shapes must be at most ", kShapesMax);
    }
    for (const ShapeEntry& entry : world_.shapes) {
      absl::Status status = validate(*entry.shape, absl::StrCat("shape ", entry.id));
      if (!status.ok()) return status;
    }
    absl::Status status =
        ascend("ids of shapes", world_.shapes, [](const ShapeEntry& entry) { return entry.id; });
    if (!status.ok()) return status;
    return bounded("the largest radius", world_.shared.radius_max, 0, world_.settings.sector_size, "m");
  }

  absl::Status order() const {
    const SharedState& shared = world_.shared;
    const auto id_of = [](const auto& item) { return item.id; };
    if (absl::Status status = ascend("ids of static bodies", shared.statics, id_of); !status.ok())
      return status;
    absl::Status status = ascend("ids of replicas", shared.known_replicas,
                                 [](const KnownReplica& known) { return known.update.id; });
    if (!status.ok()) return status;
    if (!status.ok()) return status;
    return ascend("sectors", world_.sectors, [](const MovedSector& sector) { return sector.sector; });
  }

  absl::Status properties(BodyId id, const BodyProperties& properties) const {
    if (absl::Status status = checks_.properties(id, properties); !status.ok()) return status;
    if (properties.motion == Motion::kStatic) return absl::OkStatus();
    const Shape& shape = *find_shape(world_.shapes, properties.shape);
    const double radius = bounding_radius(shape, Eigen::Vector3d(properties.centre.data()));
    return in(title_of(id), bounded("radius", radius, 0, world_.shared.radius_max, "m"));
  }

  absl::Status near(const std::string& what, const SectorIndex& home, const SectorIndex& other) const {
    return checks_.near(what, home, other);
  }
  absl::Status state(const BodyState& state) const { return checks_.state(state); }

  absl::Status body(const BodyRecord& record) {
    if (absl::Status status = properties(record.id, record.properties); !status.ok()) return status;
    if (absl::Status status = checks_.home(record.home); !status.ok()) return status;
    if (absl::Status status = state(record.state); !status.ok()) return status;
    const ProgramModules& modules = world_.settings.modules;
    if (absl::Status status = check_programs(record.properties, record.programs, modules); !status.ok())
      return status;
    if (bodies_.emplace(record.id, &record).second) return absl::OkStatus();
    return refused("the id is given twice");
  }

  absl::Status add_static(const BodyRecord& record) {
    if (record.properties.motion != Motion::kStatic) return refused("it moves, and is listed as static");
    return body(record);
  }

  absl::Status bodies(const MovedSector& sector) {
    if (absl::Status status = checks_.home(sector.sector); !status.ok()) return status;
    for (const MovedBody& moved : sector.bodies) {
      const std::string what = title_of(moved.record.id);
      if (moved.record.home != sector.sector) return refused(what, ": it is listed in a sector not its home");
      if (moved.record.properties.motion == Motion::kStatic) return refused(what, ": it is static");
      if (absl::Status status = body(moved.record); !status.ok()) return in(what, status);
      if (moved.next_home) {
        absl::Status status = near("way to its next home", sector.sector, *moved.next_home);
        if (!status.ok()) return in(what, status);
      }
      if (!moved.kinematic_target) continue;
      if (absl::Status status = state(*moved.kinematic_target); !status.ok())
        return in(absl::StrCat(what, ": kinematic target"), status);
    }
    return ascend("ids of a sector's bodies", sector.bodies,
                  [](const MovedBody& moved) { return moved.record.id; });
  }

  // Calls check(body, held) for the joints of all bodies, until one is refused.
  absl::Status for_each_held(
      const std::function<absl::Status(const MovedBody&, const HeldJoint&)>& check) const {
    for (const MovedSector& sector : world_.sectors) {
      for (const MovedBody& body : sector.bodies) {
        for (const HeldJoint& held : body.joints.as_child) {
          absl::Status status = check(body, held);
          if (!status.ok()) return in(absl::StrCat("joint ", held.record.id.value), status);
        }
      }
    }
    return absl::OkStatus();
  }

  // Each is with its child, and all that are concerned know of it.
  absl::Status joints() {
    absl::Status status = for_each_held([&](const MovedBody& body, const HeldJoint& held) -> absl::Status {
      if (held.record.properties.child != body.record.id) return refused("it is not with its child");
      if (absl::Status valid = joint(held.record); !valid.ok()) return valid;
      if (!joints_.add(tie_of(held.record))) return refused("the id is given twice");
      joints_.keep(held.record);
      return absl::OkStatus();
    });
    if (!status.ok()) return status;
    status = for_each_held([&](const MovedBody&, const HeldJoint& held) -> absl::Status {
      std::vector<JointTie> coupled;
      for (const JointId id : joints_.coupled(held.record.id)) {
        const JointTie* other = joints_.find(id);
        if (other == nullptr) return refused("the joint ", id.value, ", which it follows, is not there");
        coupled.push_back(*other);
      }
      if (held.coupled == coupled) return absl::OkStatus();
      return refused("the joints that it lists are not those that it follows, or that follow it");
    });
    if (!status.ok()) return status;
    for (const MovedSector& sector : world_.sectors) {
      for (const MovedBody& body : sector.bodies) {
        if (body.joints.as_parent == ties_of_parent(body.record.id)) continue;
        return refused(title_of(body.record.id),
                       ": the joints that it lists are not those that it is parent of");
      }
    }
    std::vector<JointTie> known_to_all;
    if (all_know_joints(world_.settings))
      joints_.for_each([&](const JointTie& tie) { known_to_all.push_back(tie); });
    if (world_.shared.joints == known_to_all) return absl::OkStatus();
    return refused("the joints that all servers know must be ",
                   all_know_joints(world_.settings) ? "all that there are" : "none");
  }

  std::vector<JointTie> ties_of_parent(BodyId body) const {
    std::vector<JointTie> ties;
    for (const JointId id : joints_.of(body)) {
      if (const JointTie& tie = *joints_.find(id); tie.parent == body) ties.push_back(tie);
    }
    return ties;
  }

  absl::Status joint(const JointRecord& record) const {
    if (record.id.value == 0) return refused("the id must be at least 1");
    const auto child = bodies_.find(record.properties.child);
    const auto parent = bodies_.find(record.properties.parent);
    if (child == bodies_.end()) return refused("its child ", record.properties.child.value, " is no body");
    const bool to_world = record.properties.parent.value == 0;
    if (!to_world && parent == bodies_.end()) {
      return refused("its parent ", record.properties.parent.value, " is no body");
    }
    const Motion motion = to_world ? Motion::kStatic : parent->second->properties.motion;
    if (motion != record.parent_motion) return refused("its parent moves otherwise than it says");
    // Frames are given in centre frames.
    BodyProperties parent_at_centre;
    if (!to_world) parent_at_centre = parent->second->properties;
    BodyProperties child_at_centre = child->second->properties;
    parent_at_centre.centre = child_at_centre.centre = {};
    const JointDescription description{absl::StrCat("joint ", record.id.value), record.properties,
                                       record.drives};
    return validate(description, to_world ? nullptr : &parent_at_centre, child_at_centre, world_.settings);
  }

  absl::Status replica(const ReplicaIntroduction& introduction, const ReplicaUpdate& update) {
    const std::string what = absl::StrCat("replica of ", title_of(update.id));
    const auto body = bodies_.find(update.id);
    if (body == bodies_.end() || introduction.id != update.id)
      return refused(what, ": there is no such body");
    if (absl::Status status = properties(introduction.id, introduction.properties); !status.ok())
      return in(what, status);
    if (introduction.properties.motion != body->second->properties.motion ||
        introduction.properties.shape != body->second->properties.shape) {
      return refused(what, ": its properties are not those of the body");
    }
    if (absl::Status status = checks_.home(update.home); !status.ok()) return in(what, status);
    if (absl::Status status = state(update.state); !status.ok()) return in(what, status);
    if (absl::Status status = near("way to its next home", update.home, update.next_home); !status.ok())
      return in(what, status);
    if (!(update.surge >= 0 && update.surge <= kSurgeMax))
      return refused(what, ": its surge must be 0 to ", kSurgeMax, " m, and is ", update.surge);
    const auto [known, is_new] = replicas_.emplace(update.id, &update);
    const ReplicaUpdate& first = *known->second;
    if (is_new ||
        (first.home == update.home && first.next_home == update.next_home &&
         first.replicated_in == update.replicated_in && first.known_everywhere == update.known_everywhere)) {
      return absl::OkStatus();
    }
    return refused(what, ": sectors know it at different places");
  }

  absl::Status visitors(const MovedSector& sector) {
    for (const MovedClone& clone : sector.clones) {
      if (absl::Status status = replica(clone.introduction, clone.update); !status.ok()) return status;
      absl::Status status = near("way to its home", sector.sector, clone.update.home);
      if (!status.ok()) return in(absl::StrCat("replica of ", title_of(clone.update.id)), status);
      const absl::StatusOr<SectorOffset> offset = offset_between(clone.update.home, sector.sector);
      if (!offset.ok() || !clone.update.replicated_in.contains(*offset)) {
        return refused("replica of ", title_of(clone.update.id), ": it is in a sector that does not need it");
      }
      if (clone.placed && sector.bodies.empty()) {
        return refused("replica of ", title_of(clone.update.id), ": it is placed in a sector without bodies");
      }
      const auto home = bodies_.find(clone.update.id);
      if (home->second->home == sector.sector && clone.placed) {
        return refused("replica of ", title_of(clone.update.id), ": it is placed in its body's own sector");
      }
    }
    absl::Status status = ascend("ids of a sector's replicas", sector.clones,
                                 [](const MovedClone& clone) { return clone.update.id; });
    if (!status.ok()) return status;
    for (int axis = 0; axis < 6; ++axis) {
      if (std::isnan(sector.static_region[axis]))
        return refused("a region of static bodies must be of numbers");
    }
    status = ascend("pairs of triggers and what is in them", sector.overlaps,
                    [](const Overlap& overlap) { return std::pair(overlap.trigger, overlap.visitor); });
    if (!status.ok()) return status;
    return ascend("pairs of a sector", sector.manifolds,
                  [](const ManifoldState& pair) { return std::pair(pair.a, pair.b); });
  }

  absl::Status seams() const {
    for (const MovedSector& sector : world_.sectors) {
      if (!sector.parts.empty() && (sector.bodies.empty() || !sector.parts_reported))
        return refused("sector ", to_string(sector.sector), " has no islands that reach over its borders");
    }
    return absl::OkStatus();
  }

  const WorldSnapshot& world_;
  RecordChecks checks_;
  absl::flat_hash_map<BodyId, const BodyRecord*> bodies_;
  absl::flat_hash_map<BodyId, const ReplicaUpdate*> replicas_;
  JointIndex joints_;
};

}  // namespace

absl::Status validate(const WorldSnapshot& world) { return Check(world).all(); }

std::vector<std::pair<SectorIndex, double>> load_of(const WorldSnapshot& world) {
  std::vector<std::pair<SectorIndex, double>> weights;
  for (const MovedSector& sector : world.sectors) {
    if (sector.bodies.empty()) continue;
    weights.emplace_back(sector.sector, 1 + static_cast<double>(sector.bodies.size()));
  }
  return weights;
}

absl::Status resume(Partition& partition, const SharedState& shared, std::span<const MovedSector> sectors) {
  for (const MovedSector& sector : sectors) {
    for (const ManifoldState& pair : sector.manifolds) {
      if (partition.engine.can_read(pair)) continue;
      return refused("the contact points of bodies ", pair.a.value, " and ", pair.b.value,
                     " are not of this engine");
    }
  }
  restore(partition, shared, sectors);
  if (resume_components(partition)) return absl::OkStatus();
  return refused("the islands of sectors at rest are not as their contacts connect them");
}

absl::Status resume(Partition& partition, const WorldSnapshot& world) {
  if (absl::Status status = open_grounds(world.shapes); !status.ok()) return status;
  for (const ShapeEntry& entry : world.shapes) add_shape(partition, entry.id, entry.shape);
  return resume(partition, world.shared, world.sectors);
}

}  // namespace tessera
