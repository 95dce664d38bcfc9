#include "lpss/simulation/world_snapshot.h"

#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string_view>
#include <variant>

#include "lpss/base/invariant.h"
#include "lpss/model/checks.h"
#include "lpss/model/validate.h"
#include "lpss/partition/bodies.h"
#include "lpss/partition/joints.h"
#include "lpss/simulation/record_checks.h"
#include "lpss/simulation/simulation.h"
#include "lpss/tick/components.h"

namespace tessera {
namespace {

template <typename Items, typename Key>
absl::Status ascend(const std::string& what, const Items& items, const Key& key) {
  const auto not_before = [&](const auto& a, const auto& b) { return !(key(a) < key(b)); };
  if (std::adjacent_find(items.begin(), items.end(), not_before) == items.end()) return absl::OkStatus();
  return refused(what, " must ascend, each once");
}

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
  absl::Status state(const SectorIndex& home, const BodyState& state) const {
    return checks_.state(home, state);
  }

  absl::Status body(const BodyRecord& record) {
    if (absl::Status status = properties(record.id, record.properties); !status.ok()) return status;
    if (absl::Status status = state(record.home, record.state); !status.ok()) return status;
    if (bodies_.emplace(record.id, &record).second) return absl::OkStatus();
    return refused("the id is given twice");
  }

  absl::Status add_static(const BodyRecord& record) {
    if (record.properties.motion != Motion::kStatic) return refused("it moves, and is listed as static");
    return body(record);
  }

  absl::Status bodies(const MovedSector& sector) {
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
      if (absl::Status status = state(sector.sector, *moved.kinematic_target); !status.ok())
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
    if (absl::Status status = state(update.home, update.state); !status.ok()) return in(what, status);
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

absl::Status name_check(const std::string& what, const std::string& name) {
  if (name.empty()) return refused(what, ": the name must not be empty");
  if (name.size() > kNameBytesMax) {
    return refused(what, ": the name's ", name.size(), " bytes must be at most ", kNameBytesMax);
  }
  return utf8(what, name);
}

// Ascending ids below `next`, and names that nothing else has.
template <typename Items, typename IdOf>
absl::Status named_once(const std::string& kind, const Items& items, std::uint64_t next, const IdOf& id_of) {
  if (absl::Status status = ascend(absl::StrCat("ids of named ", kind, "s"), items, id_of); !status.ok())
    return status;
  absl::flat_hash_set<std::string_view> names;
  for (const auto& item : items) {
    const std::uint64_t id = id_of(item).value;
    const std::string what = absl::StrCat(kind, " ", id);
    if (id == 0 || id >= next) return refused(what, ": the id must be 1 to ", next - 1);
    if (absl::Status status = name_check(what, item.name); !status.ok()) return status;
    if (!names.insert(item.name).second) return refused(what, ": the name '", item.name, "' is in use");
  }
  return absl::OkStatus();
}

// Frames of bodies that there are, with names that neither bodies nor other frames have.
absl::Status frames_check(const WorldCatalogue& catalogue) {
  if (catalogue.frames.size() > kFramesMax) {
    return refused("the world's ", catalogue.frames.size(), " frames must be at most ", kFramesMax);
  }
  absl::flat_hash_set<std::string_view> names;
  absl::flat_hash_set<BodyId> bodies;
  for (const WorldCatalogue::Body& body : catalogue.bodies) {
    names.insert(body.name);
    bodies.insert(body.id);
  }
  for (const WorldCatalogue::Frame& frame : catalogue.frames) {
    const std::string what = absl::StrCat("frame '", frame.name, "'");
    absl::Status status = validate(FrameDescription{frame.name, 0, frame.pose}, /*bodies=*/1);
    if (!status.ok()) return in(what, status);
    if (!bodies.contains(frame.body)) return refused(what, ": body ", frame.body.value, " has no name");
    if (!names.insert(frame.name).second) return refused(what, ": the name is in use");
  }
  return absl::OkStatus();
}

// Ids of shapes below the next one, that held commands are in bounds, and that the bodies have shapes which
// none of them forgets.
absl::Status held_check(const WorldCatalogue& catalogue, const WorldSnapshot& world) {
  std::vector<ShapeEntry> all = world.shapes;
  for (const WorldCatalogue::HeldBatch& batch : catalogue.held) {
    for (const ShapeEntry& entry : batch.new_shapes) {
      absl::Status status = validate(*entry.shape, absl::StrCat("shape ", entry.id, " of a held command"));
      if (!status.ok()) return status;
      all.push_back(entry);
    }
  }
  if (all.size() > kShapesMax) {
    return refused("the world's ", all.size(), " shapes must be at most ", kShapesMax);
  }
  absl::Status status = ascend("ids of shapes", all, [](const ShapeEntry& entry) { return entry.id; });
  if (!status.ok()) return status;
  if (!all.empty() && all.back().id >= catalogue.next_shape) {
    return refused("shape ", all.back().id, ": the id must be below the next one, ", catalogue.next_shape);
  }
  const RecordChecks checks(world.settings, [&](ShapeId id) { return find_shape(all, id); });
  absl::flat_hash_set<ShapeId> forgotten;
  for (const WorldCatalogue::HeldBatch& batch : catalogue.held) {
    for (const Command& command : batch.commands) {
      if (status = checks.command(command); !status.ok()) return in("a held command", status);
      const auto* removal = std::get_if<RemoveBody>(&command);
      if (removal == nullptr || !removal->last_of) continue;
      const bool is_known = find_shape(all, *removal->last_of) != nullptr;
      if (is_known && forgotten.insert(*removal->last_of).second) continue;
      return refused("a held command forgets shape ", *removal->last_of, ", which is not there");
    }
  }
  for (const WorldCatalogue::Body& body : catalogue.bodies) {
    const ShapeId shape = body.properties.shape;
    if (find_shape(all, shape) != nullptr && !forgotten.contains(shape)) continue;
    return refused(title_of(body.id), ": there is no shape ", shape);
  }
  return absl::OkStatus();
}

// How many bodies and joints the state has, by the ids that a catalogue may lack only for held commands.
absl::Status all_named(const WorldCatalogue& catalogue, const WorldSnapshot& world) {
  absl::flat_hash_map<BodyId, Motion> bodies;
  for (const WorldCatalogue::Body& body : catalogue.bodies) bodies.emplace(body.id, body.properties.motion);
  absl::flat_hash_set<BodyId> gone;
  for (const WorldCatalogue::HeldBatch& batch : catalogue.held) {
    for (const Command& command : batch.commands) {
      if (const auto* removal = std::get_if<RemoveBody>(&command)) gone.insert(removal->id);
    }
  }
  const auto check = [&](const BodyRecord& record) -> absl::Status {
    if (record.id >= catalogue.next_body) {
      return refused(title_of(record.id), ": the id must be below the next one, ", catalogue.next_body.value);
    }
    const auto named = bodies.find(record.id);
    if (named == bodies.end() && gone.contains(record.id)) return absl::OkStatus();
    if (named == bodies.end()) return refused(title_of(record.id), ": it has no name");
    if (named->second == record.properties.motion) return absl::OkStatus();
    return refused(title_of(record.id), ": its name belongs to one that moves otherwise");
  };
  for (const BodyRecord& record : world.shared.statics) {
    if (absl::Status status = check(record); !status.ok()) return status;
  }
  for (const MovedSector& sector : world.sectors) {
    for (const MovedBody& moved : sector.bodies) {
      if (absl::Status status = check(moved.record); !status.ok()) return status;
      for (const HeldJoint& held : moved.joints.as_child) {
        if (held.record.id < catalogue.next_joint) continue;
        return refused("joint ", held.record.id.value, ": the id must be below the next one, ",
                       catalogue.next_joint.value);
      }
    }
  }
  return absl::OkStatus();
}

}  // namespace

WorldCatalogue catalogue_of(const WorldDescription& world, std::span<const BodyRecord> records,
                            std::span<const JointRecord> joints) {
  WorldCatalogue catalogue;
  catalogue.name = world.name;
  for (std::size_t n = 0; n < records.size(); ++n) {
    catalogue.bodies.push_back({records[n].id, world.bodies[n].name, records[n].properties});
  }
  for (std::size_t n = 0; n < joints.size(); ++n)
    catalogue.joints.push_back({world.joints[n].name, joints[n]});
  for (const FrameDescription& frame : world.frames) {
    catalogue.frames.push_back({frame.name, records[frame.body].id, frame.pose});
  }
  catalogue.next_body = BodyId{records.size() + 1};
  catalogue.next_joint = JointId{joints.size() + 1};
  catalogue.next_shape = world.shapes.size();
  return catalogue;
}

WorldCatalogue catalogue_of(const WorldDescription& world) {
  const absl::StatusOr<std::vector<BodyRecord>> records = records_of(world);
  const absl::StatusOr<std::vector<JointRecord>> joints = joint_records_of(world);
  invariant(records.ok() && joints.ok(), "a world with a catalogue is valid");
  return catalogue_of(world, *records, *joints);
}

absl::Status validate(const WorldCatalogue& catalogue, const WorldSnapshot& world) {
  if (catalogue.next_body.value > kBodyIdMax + 1) {
    return refused("the next body's id must be at most ", kBodyIdMax + 1);
  }
  absl::Status status = named_once("body", catalogue.bodies, catalogue.next_body.value,
                                   [](const WorldCatalogue::Body& body) { return body.id; });
  if (!status.ok()) return status;
  status = named_once("joint", catalogue.joints, catalogue.next_joint.value,
                      [](const WorldCatalogue::Joint& joint) { return joint.record.id; });
  if (!status.ok()) return status;
  if (status = frames_check(catalogue); !status.ok()) return status;
  if (status = held_check(catalogue, world); !status.ok()) return status;
  return all_named(catalogue, world);
}

absl::Status validate(const WorldSnapshot& world) { return Check(world).all(); }

std::vector<std::pair<SectorIndex, double>> load_of(const WorldSnapshot& world) {
  std::vector<std::pair<SectorIndex, double>> weights;
  for (const MovedSector& sector : world.sectors) {
    if (sector.bodies.empty()) continue;
    weights.emplace_back(sector.sector, 1 + static_cast<double>(sector.bodies.size()));
  }
  return weights;
}

SectorMap placed(const WorldSnapshot& world, std::uint32_t servers, std::uint64_t epoch) {
  return SectorMap::balanced(world.anchor, load_of(world), servers, epoch);
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
