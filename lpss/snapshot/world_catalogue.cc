#include "lpss/snapshot/world_catalogue.h"

#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>
#include <absl/strings/str_cat.h>

#include <string_view>
#include <variant>

#include "lpss/base/invariant.h"
#include "lpss/model/checks.h"
#include "lpss/model/validate.h"
#include "lpss/model/world_records.h"
#include "lpss/snapshot/record_checks.h"

namespace tessera {
namespace {

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

// That all bodies and joints of the state have names; a body may lack one, or move otherwise than its name
// says, only for held commands.
absl::Status all_named(const WorldCatalogue& catalogue, const WorldSnapshot& world) {
  absl::flat_hash_map<BodyId, Motion> bodies;
  for (const WorldCatalogue::Body& body : catalogue.bodies) bodies.emplace(body.id, body.properties.motion);
  absl::flat_hash_set<BodyId> gone;
  absl::flat_hash_set<BodyId> changed;
  for (const WorldCatalogue::HeldBatch& batch : catalogue.held) {
    for (const Command& command : batch.commands) {
      if (const auto* removal = std::get_if<RemoveBody>(&command)) gone.insert(removal->id);
      if (const auto* change = std::get_if<SetProperties>(&command)) changed.insert(change->id);
    }
  }
  const auto check = [&](const BodyRecord& record) -> absl::Status {
    if (record.id >= catalogue.next_body) {
      return refused(title_of(record.id), ": the id must be below the next one, ", catalogue.next_body.value);
    }
    const auto named = bodies.find(record.id);
    if (named == bodies.end() && gone.contains(record.id)) return absl::OkStatus();
    if (named == bodies.end()) return refused(title_of(record.id), ": it has no name");
    const Motion motion = record.properties.motion;
    const bool may_change = changed.contains(record.id) && motion != Motion::kStatic;
    if (named->second == motion || (may_change && named->second != Motion::kStatic)) return absl::OkStatus();
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
    catalogue.bodies.push_back(
        {records[n].id, world.bodies[n].name, records[n].properties, tags_of(world.bodies[n])});
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

BodyTags tags_of(const BodyDescription& body, std::string owner) {
  BodyTags tags{std::move(owner), body.user_data, {}};
  for (const ProgramRecord& program : body.programs) tags.programs.push_back(program.kind);
  return tags;
}

absl::Status validate(const BodyTags& tags) {
  if (tags.programs.size() > kProgramsPerBodyMax)
    return refused(tags.programs.size(), " programs must be at most ", kProgramsPerBodyMax);
  if (absl::Status status = sized("owner", tags.owner, kNameBytesMax); !status.ok()) return status;
  if (absl::Status status = utf8("owner", tags.owner); !status.ok()) return status;
  return sized("user data", tags.user_data, kUserDataBytesMax);
}

absl::Status validate(const WorldCatalogue& catalogue, const WorldSnapshot& world) {
  if (catalogue.next_body.value > kBodyIdMax + 1) {
    return refused("the next body's id must be at most ", kBodyIdMax + 1);
  }
  absl::Status status = named_once("body", catalogue.bodies, catalogue.next_body.value,
                                   [](const WorldCatalogue::Body& body) { return body.id; });
  if (!status.ok()) return status;
  for (const WorldCatalogue::Body& body : catalogue.bodies) {
    if (status = validate(body.tags); !status.ok()) return in(absl::StrCat("body ", body.id.value), status);
  }
  status = named_once("joint", catalogue.joints, catalogue.next_joint.value,
                      [](const WorldCatalogue::Joint& joint) { return joint.record.id; });
  if (!status.ok()) return status;
  if (status = frames_check(catalogue); !status.ok()) return status;
  if (status = held_check(catalogue, world); !status.ok()) return status;
  return all_named(catalogue, world);
}

}  // namespace tessera
