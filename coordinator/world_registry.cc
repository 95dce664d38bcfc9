#include "coordinator/world_registry.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <set>
#include <utility>

#include "coordinator/limits.h"
#include "coordinator/models.h"
#include "lpss/base/invariant.h"
#include "lpss/model/limits.h"
#include "lpss/model/validate.h"
#include "lpss/model/world_records.h"
#include "lpss/programs/registry.h"
#include "proto/convert.h"

namespace tessera {

WorldRegistry::WorldRegistry(const WorldDescription& world, std::span<const BodyRecord> records,
                             std::span<const JointRecord> joints)
    : settings_(world.settings),
      shapes_(world.shapes),
      joints_(world.joints, joints),
      frames_(world.frames, records) {
  invariant(world.bodies.size() == records.size(), "every body of a world has a record");
  for (std::size_t n = 0; n < records.size(); ++n) {
    insert(records[n].id, world.bodies[n].name, records[n].properties, tags_of(world.bodies[n]));
    next_id_ = BodyId{records[n].id.value + 1};
  }
}

WorldRegistry::WorldRegistry(const WorldSnapshot& world, const WorldCatalogue& catalogue)
    : settings_(world.settings), shapes_(catalogue.next_shape), joints_(catalogue), frames_(catalogue) {
  for (const ShapeEntry& entry : world.shapes) shapes_.add(entry, world.tick);
  Tick tick = world.tick;
  for (const WorldCatalogue::HeldBatch& batch : catalogue.held) {
    ++tick;
    for (const ShapeEntry& entry : batch.new_shapes) shapes_.add(entry, tick);
    for (const Command& command : batch.commands) {
      const auto* removal = std::get_if<RemoveBody>(&command);
      if (removal != nullptr && removal->last_of) shapes_.leave(*removal->last_of, tick);
    }
  }
  for (const WorldCatalogue::Body& body : catalogue.bodies) {
    insert(body.id, body.name, body.properties, body.tags);
  }
  next_id_ = catalogue.next_body;
}

void WorldRegistry::skip_ids_below(BodyId body, JointId joint) {
  next_id_ = std::max(next_id_, body);
  joints_.skip_ids_below(joint);
}

WorldCatalogue WorldRegistry::next_ids() const {
  WorldCatalogue catalogue;
  catalogue.next_body = next_id_;
  catalogue.next_joint = joints_.next_id();
  catalogue.next_shape = shapes_.next_id();
  return catalogue;
}

WorldCatalogue WorldRegistry::catalogue() const {
  WorldCatalogue catalogue = next_ids();
  for (const auto& [id, entry] : bodies_) {
    catalogue.bodies.push_back({id, entry.name, entry.properties, entry.tags});
  }
  joints_.describe(catalogue);
  frames_.describe(catalogue);
  return catalogue;
}

void WorldRegistry::insert(BodyId id, std::string name, const BodyProperties& properties, BodyTags tags) {
  const auto [entry, is_new] = bodies_.emplace(id, Entry{std::move(name), properties, std::move(tags)});
  invariant(is_new && names_.emplace(entry->second.name, id).second, "ids and names of bodies are unique");
  shapes_.take(properties.shape);
}

absl::StatusOr<BodyId> WorldRegistry::resolve(const v1::BodyRef& reference) const {
  switch (reference.by_case()) {
    case v1::BodyRef::kId:
      if (bodies_.contains(BodyId{reference.id()})) return BodyId{reference.id()};
      return absl::NotFoundError(absl::StrCat("there is no body with the id ", reference.id()));
    case v1::BodyRef::kName: {
      const auto found = names_.find(reference.name());
      if (found != names_.end()) return found->second;
      if (const FrameRegistry::Entry* frame = frames_.find(reference.name())) {
        return absl::InvalidArgumentError(absl::StrCat("'", reference.name(), "' is a frame of the body '",
                                                       find(frame->body)->name, "', and no body itself"));
      }
      return absl::NotFoundError(absl::StrCat("there is no body with the name '", reference.name(), "'"));
    }
    case v1::BodyRef::BY_NOT_SET:
      break;
  }
  return absl::InvalidArgumentError("body: an id or a name must be set");
}

const WorldRegistry::Entry* WorldRegistry::find(BodyId id) const {
  const auto found = bodies_.find(id);
  return found == bodies_.end() ? nullptr : &found->second;
}

std::vector<BodyId> WorldRegistry::with_prefix(std::string_view prefix) const {
  std::vector<BodyId> ids;
  for (auto name = names_.lower_bound(prefix); name != names_.end() && name->first.starts_with(prefix);
       ++name) {
    ids.push_back(name->second);
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

absl::Status WorldRegistry::check_room(std::size_t bodies) const {
  if (bodies_.size() + bodies > kBodiesMax) {
    return absl::ResourceExhaustedError(absl::StrCat("the world has ", bodies_.size(), " bodies, and with ",
                                                     bodies, " more it would have more than ", kBodiesMax));
  }
  if (const std::uint64_t last = body_id_max(settings_.seams); next_id_.value + bodies - 1 > last) {
    return absl::ResourceExhaustedError(absl::StrCat("all ids of bodies up to ", last, " have been given"));
  }
  return absl::OkStatus();
}

bool WorldRegistry::has_name(const std::string& name) const {
  return names_.contains(name) || frames_.find(name) != nullptr;
}

std::string WorldRegistry::name_for(BodyId id) const {
  const std::string name = absl::StrCat("body_", id.value);
  std::string unique = name;
  for (int n = 2; has_name(unique); ++n) unique = absl::StrCat(name, "_", n);
  return unique;
}

absl::Status WorldRegistry::check_names(const WorldDescription& model) const {
  const auto in_use = [](const char* kind, const std::string& name) {
    return absl::AlreadyExistsError(absl::StrCat(kind, " '", name, "': the name is in use"));
  };
  for (const BodyDescription& body : model.bodies) {
    if (has_name(body.name)) return in_use("body", body.name);
  }
  for (const FrameDescription& frame : model.frames) {
    if (has_name(frame.name)) return in_use("frame", frame.name);
  }
  for (const JointDescription& joint : model.joints) {
    if (joints_.has_name(joint.name)) return in_use("joint", joint.name);
  }
  return absl::OkStatus();
}

// For one more, which has so many bytes.
absl::Status WorldRegistry::room_for_shape(const std::string& title, std::size_t bytes,
                                           std::size_t bytes_max) const {
  if (shapes_.size() >= kShapesMax) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the world has ", kShapesMax, " different shapes, and may not have more"));
  }
  const std::size_t all = shapes_.bytes() + bytes;
  if (all <= bytes_max) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat(title, ": with it, the shapes of the world would have ",
                                                   all, " bytes, and may have ", bytes_max,
                                                   " (--shapes-mib)"));
}

// The bodies of the model then have the ids of the world's shapes.
absl::Status WorldRegistry::take_shapes(WorldDescription& model, const v1::Spawn& spawn, Tick at,
                                        std::size_t bytes_max, Spawned& spawned) {
  std::vector<std::optional<ShapeId>> ids(model.shapes.size());
  for (BodyDescription& body : model.bodies) {
    const auto place = static_cast<int>(body.properties.shape);
    std::optional<ShapeId>& id = ids[place];
    if (!id) id = shapes_.find_equal(model.shapes[place]);
    if (!id) {
      const v1::Shape& shape = spawn.model().shapes(place);
      const std::string title = absl::StrCat("shape of body '", body.name, "'");
      if (absl::Status room = room_for_shape(title, shape.ByteSizeLong(), bytes_max); !room.ok()) return room;
      id = shapes_.add(model.shapes[place], at, undo_);
      v1::NumberedShape& numbered = spawned.new_shapes.emplace_back();
      numbered.set_id(*id);
      *numbered.mutable_shape() = shape;
    }
    body.properties.shape = *id;
  }
  return absl::OkStatus();
}

absl::StatusOr<WorldRegistry::Spawned> WorldRegistry::spawn(const v1::Spawn& spawn, Tick at,
                                                            const std::string& owner,
                                                            std::size_t shape_bytes_max) {
  if (absl::Status status = check_room(spawn.model().bodies_size()); !status.ok()) return status;
  if (absl::Status status = joints_.room(spawn.model().joints_size()); !status.ok()) return status;
  const BodyId first{next_id_.value};
  const JointId first_joint = joints_.next_id();
  absl::StatusOr<WorldDescription> model =
      placed_model(spawn, settings_, kSpawnedAssemblies + first.value,
                   {[&](std::size_t n) { return name_for(BodyId{first.value + n}); },
                    [&](std::size_t n) { return joints_.free_name(JointId{first_joint.value + n}); }});
  if (!model.ok()) return model.status();
  absl::StatusOr<std::vector<BodyRecord>> records = records_of(*model);
  if (!records.ok()) return records.status();
  absl::StatusOr<std::vector<JointRecord>> joints = joint_records_of(*model);
  if (!joints.ok()) return joints.status();
  if (absl::Status status = check_programs(*model); !status.ok()) return status;
  if (absl::Status status = check_names(*model); !status.ok()) return status;

  Spawned spawned;
  if (absl::Status status = take_shapes(*model, spawn, at, shape_bytes_max, spawned); !status.ok())
    return status;
  const std::size_t modules = settings_.modules.size();
  undo_.add([this, first, modules] {
    next_id_ = first;
    settings_.modules.resize(modules);
  });
  settings_.modules = model->settings.modules;
  spawned.new_modules.assign(settings_.modules.begin() + static_cast<std::ptrdiff_t>(modules),
                             settings_.modules.end());
  for (std::size_t n = 0; n < records->size(); ++n) {
    BodyRecord& record = (*records)[n];
    record.id = BodyId{first.value + n};
    record.properties.shape = model->bodies[n].properties.shape;
    for (ProgramRecord& program : record.programs) move_ids(program, first.value - 1, first_joint.value - 1);
    insert(record.id, model->bodies[n].name, record.properties, tags_of(model->bodies[n], owner));
    undo_.add([this, id = record.id] {
      const auto body = bodies_.find(id);
      names_.erase(body->second.name);
      shapes_.release(body->second.properties.shape);
      bodies_.erase(body);
    });
  }
  next_id_ = BodyId{first.value + records->size()};
  for (std::size_t n = 0; n < joints->size(); ++n) {
    JointRecord& joint = (*joints)[n];
    joint.id = JointId{first_joint.value + n};
    JointProperties& properties = joint.properties;
    if (properties.parent.value != 0) properties.parent.value += first.value - 1;
    properties.child.value += first.value - 1;
    for (JointAxis& axis : properties.axes) {
      if (axis.mimic.is_set()) axis.mimic.leader.value += first_joint.value - 1;
    }
    joints_.add(std::move(model->joints[n].name), joint, undo_);
  }
  for (const FrameDescription& frame : model->frames)
    frames_.add(frame.name, {BodyId{first.value + frame.body}, frame.pose}, undo_);
  ++changes_;
  spawned.bodies = *std::move(records);
  spawned.joints = *std::move(joints);
  return spawned;
}

RemoveBody WorldRegistry::removal_of(BodyId id) const {
  const ShapeId shape = bodies_.at(id).properties.shape;
  return {id, shapes_.has_one_body(shape) ? std::optional(shape) : std::nullopt};
}

void WorldRegistry::remove(BodyId id, Tick at) {
  const auto found = bodies_.find(id);
  if (found == bodies_.end()) return;
  joints_.remove_of(id, undo_);
  frames_.remove_of(id, undo_);
  shapes_.give_back(found->second.properties.shape, at, undo_);
  names_.erase(found->second.name);
  undo_.add([this, node = bodies_.extract(found)]() mutable {
    const auto back = bodies_.insert(std::move(node)).position;
    names_.emplace(back->second.name, back->first);
  });
}

void WorldRegistry::change(BodyId id, const BodyProperties& properties) {
  undo_.add([this, id, before = std::exchange(bodies_.at(id).properties, properties)] {
    bodies_.at(id).properties = before;
  });
}

void WorldRegistry::set_tags(BodyId id, BodyTags tags) {
  undo_.add([this, id, before = std::exchange(bodies_.at(id).tags, std::move(tags))] {
    bodies_.at(id).tags = before;
  });
  ++changes_;
}

// The body that a reference names, or the one given by id if there is no reference; 0 stays 0.
absl::StatusOr<BodyId> WorldRegistry::body_of_joint(const char* side, const v1::BodyRef& reference,
                                                    BodyId otherwise) const {
  const bool is_named = reference.by_case() != v1::BodyRef::BY_NOT_SET;
  if (!is_named && otherwise.value == 0) return otherwise;
  v1::BodyRef by_id;
  by_id.set_id(otherwise.value);
  absl::StatusOr<BodyId> id = resolve(is_named ? reference : by_id);
  if (id.ok()) return id;
  return absl::Status(id.status().code(), absl::StrCat(side, ": ", id.status().message()));
}

absl::StatusOr<JointRecord> WorldRegistry::add_joint(const v1::AddJoint& request) {
  if (!request.has_joint()) return absl::InvalidArgumentError("joint must be set");
  absl::StatusOr<JointDescription> joint = from_proto(request.joint());
  if (!joint.ok()) return joint.status();
  if (joint->name.empty()) joint->name = joints_.free_name(joints_.next_id());
  const auto in = [&joint](const absl::Status& status) {
    return absl::Status(status.code(), absl::StrCat("joint '", joint->name, "': ", status.message()));
  };
  JointProperties& properties = joint->properties;
  const absl::StatusOr<BodyId> parent = body_of_joint("parent", request.parent(), properties.parent);
  if (!parent.ok()) return in(parent.status());
  const absl::StatusOr<BodyId> child = body_of_joint("child", request.child(), properties.child);
  if (!child.ok()) return in(child.status());
  if (child->value == 0) return in(absl::InvalidArgumentError("child: an id or a name must be set"));
  properties.parent = *parent;
  properties.child = *child;
  if (absl::Status status = leaders_last(properties); !status.ok()) return in(status);
  const BodyProperties* parent_body = parent->value == 0 ? nullptr : &find(*parent)->properties;
  ++changes_;
  return joints_.add(*std::move(joint), parent_body, find(*child)->properties, settings_, undo_);
}

// Only servers know which joints programs have removed.
absl::Status WorldRegistry::leaders_last(const JointProperties& joint) const {
  for (const JointAxis& axis : axes_of(joint)) {
    const JointRegistry::Entry* const leader = joints_.find(axis.mimic.leader);
    if (leader == nullptr) continue;
    for (const BodyId id : {leader->record.properties.parent, leader->record.properties.child}) {
      const Entry* const body = find(id);
      if (body == nullptr) continue;
      for (const std::string& kind : body->tags.programs) {
        const Program* const program = find_program(kind);
        if (program == nullptr || !program->removes_joints()) continue;
        return absl::FailedPreconditionError(absl::StrCat("mimic leader: joint '", leader->name,
                                                          "' may be removed by the program ", kind,
                                                          " of body '", body->name, "'"));
      }
    }
  }
  return absl::OkStatus();
}

AddJoint WorldRegistry::addition_of(const JointRecord& joint) const {
  AddJoint command{joint, {}};
  for (const JointAxis& axis : axes_of(joint.properties)) {
    if (axis.mimic.is_set()) command.leaders.push_back(tie_of(joints_.find(axis.mimic.leader)->record));
  }
  return command;
}

void WorldRegistry::apply(const Command& command, Tick at) {
  if (const auto* body = std::get_if<RemoveBody>(&command)) {
    remove(body->id, at);
  } else if (const auto* joint = std::get_if<RemoveJoint>(&command)) {
    joints_.remove(joint->id, undo_);
  } else if (const auto* motion = std::get_if<SetSurfaceMotion>(&command)) {
    BodyProperties properties = bodies_.at(motion->id).properties;
    set_surface_motion(properties, motion->velocity, motion->running);
    change(motion->id, properties);
  } else if (const auto* push = std::get_if<SetForce>(&command)) {
    BodyProperties properties = bodies_.at(push->id).properties;
    properties.lasting = push->force;
    change(push->id, properties);
  } else if (const auto* changed = std::get_if<SetProperties>(&command)) {
    change(changed->id, changed->properties);
    joints_.set_parent_motion(changed->id, changed->properties.motion, undo_);
  } else if (const auto* drives = std::get_if<SetDrives>(&command)) {
    joints_.set_drives(drives->id, drives->drives, undo_);
  } else {
    return;
  }
  ++changes_;
}

v1::FoundJoints WorldRegistry::find(const v1::FindJoints& query) const {
  const std::uint64_t wanted = query.limit() == 0 ? kFoundBodiesDefault : query.limit();
  const std::size_t limit = std::min(wanted, kFoundBodiesMax);
  std::vector<JointId> ids = joints_.with_prefix(query.name_prefix(), limit + 1);
  v1::FoundJoints reply;
  reply.set_truncated(ids.size() > limit);
  if (ids.size() > limit) ids.resize(limit);
  for (const JointId id : ids) {
    const JointRegistry::Entry& entry = *joints_.find(id);
    JointDescription joint{entry.name, entry.record.properties, entry.record.drives};
    v1::FoundJoints::Found& found = *reply.add_joints();
    found.set_id(id.value);
    // From the simulated centre frames back to the body frames of clients.
    const Entry& child = bodies_.at(joint.properties.child);
    joint.properties.in_child = centre_frame(child.properties) * joint.properties.in_child;
    found.set_child(child.name);
    *found.mutable_child_centre() = to_proto(centre_frame(child.properties).position);
    if (joint.properties.parent.value != 0) {
      const Entry& parent = bodies_.at(joint.properties.parent);
      joint.properties.in_parent = centre_frame(parent.properties) * joint.properties.in_parent;
      found.set_parent(parent.name);
      *found.mutable_parent_centre() = to_proto(centre_frame(parent.properties).position);
    }
    *found.mutable_joint() = to_proto(joint);
  }
  return reply;
}

v1::FoundFrames WorldRegistry::find(const v1::FindFrames& query) const {
  const std::uint64_t wanted = query.limit() == 0 ? kFoundBodiesDefault : query.limit();
  const std::size_t limit = std::min(wanted, kFoundBodiesMax);
  v1::FoundFrames reply;
  for (const auto& [name, entry] : frames_.with_prefix(query.name_prefix(), limit + 1)) {
    if (reply.frames_size() == static_cast<int>(limit)) {
      reply.set_truncated(true);
      break;
    }
    v1::FoundFrames::Found& found = *reply.add_frames();
    found.mutable_frame()->set_name(std::string(name));
    found.mutable_frame()->set_body(entry->body.value);
    *found.mutable_frame()->mutable_pose() = to_proto(entry->pose);
    found.set_body(bodies_.at(entry->body).name);
  }
  return reply;
}

v1::FoundBodies WorldRegistry::find(const v1::FindBodies& query) const {
  const std::uint64_t wanted = query.limit() == 0 ? kFoundBodiesDefault : query.limit();
  const std::size_t limit = std::min(wanted, kFoundBodiesMax);
  const std::string_view prefix = query.name_prefix();
  std::vector<BodyId> ids;
  const auto consider = [&](BodyId id, const Entry& entry) {
    if (query.only_static() && entry.properties.motion != Motion::kStatic) return;
    if (entry.name.starts_with(prefix)) ids.push_back(id);
  };
  if (!query.ids().empty()) {
    for (const std::uint64_t id : std::set<std::uint64_t>(query.ids().begin(), query.ids().end())) {
      if (const Entry* entry = find(BodyId{id})) consider(BodyId{id}, *entry);
    }
  } else if (prefix.empty()) {
    for (auto body = bodies_.begin(); body != bodies_.end() && ids.size() <= limit; ++body) {
      consider(body->first, body->second);
    }
  } else {
    for (const BodyId id : with_prefix(prefix)) consider(id, bodies_.at(id));
  }
  v1::FoundBodies reply;
  reply.set_truncated(ids.size() > limit);
  if (ids.size() > limit) ids.resize(limit);
  std::size_t shape_bytes = 0;
  for (const BodyId id : ids) {
    if (shape_bytes > kReplyShapeBytesMax) {
      reply.set_truncated(true);
      break;
    }
    const Entry& entry = bodies_.at(id);
    v1::FoundBodies::Found& found = *reply.add_bodies();
    found.set_id(id.value);
    found.set_name(entry.name);
    *found.mutable_properties() = to_proto(entry.properties);
    found.set_user_data(entry.tags.user_data);
    found.set_owner(entry.tags.owner);
    const ShapeId shape = entry.properties.shape;
    if (query.with_shapes() && !reply.shapes().contains(shape)) {
      v1::Shape& message = (*reply.mutable_shapes())[shape];
      message = to_proto(*shapes_.ref(shape));
      shape_bytes += message.ByteSizeLong();
    }
  }
  return reply;
}

}  // namespace tessera
