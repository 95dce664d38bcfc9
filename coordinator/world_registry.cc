#include "coordinator/world_registry.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <set>
#include <utility>

#include "coordinator/limits.h"
#include "lpss/base/invariant.h"
#include "lpss/model/limits.h"
#include "lpss/model/validate.h"
#include "lpss/model/world_records.h"
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
    insert(records[n].id, world.bodies[n].name, records[n].properties);
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
  for (const WorldCatalogue::Body& body : catalogue.bodies) insert(body.id, body.name, body.properties);
  next_id_ = catalogue.next_body;
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
  for (const auto& [id, entry] : bodies_) catalogue.bodies.push_back({id, entry.name, entry.properties});
  joints_.describe(catalogue);
  frames_.describe(catalogue);
  return catalogue;
}

void WorldRegistry::insert(BodyId id, std::string name, const BodyProperties& properties) {
  const auto [entry, is_new] = bodies_.emplace(id, Entry{std::move(name), properties});
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

absl::Status WorldRegistry::check_room() const {
  if (bodies_.size() >= kBodiesMax) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the world has ", bodies_.size(), " bodies, and may have ", kBodiesMax));
  }
  if (const std::uint64_t last = body_id_max(settings_.seams); next_id_.value > last) {
    return absl::ResourceExhaustedError(absl::StrCat("all ids of bodies up to ", last, " have been given"));
  }
  return absl::OkStatus();
}

std::string WorldRegistry::name_for(BodyId id) const {
  const std::string name = absl::StrCat("body_", id.value);
  std::string unique = name;
  for (int n = 2; names_.contains(unique) || frames_.find(unique) != nullptr; ++n)
    unique = absl::StrCat(name, "_", n);
  return unique;
}

absl::StatusOr<BodyRecord> WorldRegistry::checked_record(const BodyDescription& body,
                                                         const Shape* shape) const {
  if (shape == nullptr) {
    return absl::InvalidArgumentError(
        absl::StrCat("body '", body.name, "': there is no shape ", body.properties.shape));
  }
  if (absl::Status status = validate(body, *shape, settings_); !status.ok()) return status;
  return record_of(body, settings_);
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

absl::StatusOr<WorldRegistry::Spawned> WorldRegistry::spawn(const v1::SpawnRequest& request, Tick at,
                                                            std::size_t shape_bytes_max) {
  if (absl::Status status = check_room(); !status.ok()) return status;
  if (!request.has_body()) return absl::InvalidArgumentError("body must be set");
  absl::StatusOr<BodyDescription> body = from_proto(request.body());
  if (!body.ok()) return body.status();
  if (body->name.empty()) body->name = name_for(next_id_);
  if (names_.contains(body->name) || frames_.find(body->name) != nullptr) {
    return absl::AlreadyExistsError(absl::StrCat("body '", body->name, "': the name is in use"));
  }

  std::optional<Shape> new_shape;
  if (request.has_shape()) {
    const std::string title = absl::StrCat("shape of body '", body->name, "'");
    absl::StatusOr<Shape> shape = from_proto(request.shape());
    if (!shape.ok()) {
      return absl::InvalidArgumentError(absl::StrCat(title, ": ", shape.status().message()));
    }
    if (absl::Status status = validate(*shape, title); !status.ok()) return status;
    if (const std::optional<ShapeId> known = shapes_.find_equal(*shape)) {
      body->properties.shape = *known;
    } else {
      const absl::Status room = room_for_shape(title, request.shape().ByteSizeLong(), shape_bytes_max);
      if (!room.ok()) return room;
      body->properties.shape = shapes_.next_id();
      new_shape = *std::move(shape);
    }
  }
  absl::StatusOr<BodyRecord> record =
      checked_record(*body, new_shape ? &*new_shape : shapes_.find(body->properties.shape));
  if (!record.ok()) return record.status();
  std::optional<v1::NumberedShape> numbered;
  if (new_shape) {
    numbered.emplace().set_id(shapes_.add(*std::move(new_shape), at));
    *numbered->mutable_shape() = request.shape();
  }

  record->id = next_id_;
  next_id_ = BodyId{next_id_.value + 1};
  insert(record->id, std::move(body->name), record->properties);
  ++changes_;
  return Spawned{*std::move(record), std::move(numbered)};
}

RemoveBody WorldRegistry::removal_of(BodyId id) const {
  const ShapeId shape = bodies_.at(id).properties.shape;
  return {id, shapes_.has_one_body(shape) ? std::optional(shape) : std::nullopt};
}

void WorldRegistry::remove(BodyId id, Tick at) {
  const auto found = bodies_.find(id);
  if (found == bodies_.end()) return;
  joints_.remove_of(id);
  frames_.remove_of(id);
  shapes_.give_back(found->second.properties.shape, at);
  names_.erase(found->second.name);
  bodies_.erase(found);
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

absl::StatusOr<JointRecord> WorldRegistry::add_joint(const v1::AddJointRequest& request) {
  if (!request.has_joint()) return absl::InvalidArgumentError("joint must be set");
  absl::StatusOr<JointDescription> joint = from_proto(request.joint());
  if (!joint.ok()) return joint.status();
  if (joint->name.empty()) joint->name = joints_.free_name();
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
  const BodyProperties* parent_body = parent->value == 0 ? nullptr : &find(*parent)->properties;
  ++changes_;
  return joints_.add(*std::move(joint), parent_body, find(*child)->properties, settings_);
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
    joints_.remove(joint->id);
  } else if (const auto* motion = std::get_if<SetSurfaceMotion>(&command)) {
    set_surface_motion(bodies_.at(motion->id).properties, motion->velocity, motion->running);
  } else if (const auto* drives = std::get_if<SetDrives>(&command)) {
    joints_.set_drives(drives->id, drives->drives);
  } else {
    return;
  }
  ++changes_;
}

v1::ListJointsReply WorldRegistry::list_joints(const v1::ListJointsRequest& request) const {
  const std::uint64_t wanted = request.limit() == 0 ? kFoundBodiesDefault : request.limit();
  const std::size_t limit = std::min(wanted, kFoundBodiesMax);
  std::vector<JointId> ids = joints_.with_prefix(request.name_prefix(), limit + 1);
  v1::ListJointsReply reply;
  reply.set_truncated(ids.size() > limit);
  if (ids.size() > limit) ids.resize(limit);
  for (const JointId id : ids) {
    const JointRegistry::Entry& entry = *joints_.find(id);
    JointDescription joint{entry.name, entry.record.properties, entry.record.drives};
    v1::ListJointsReply::Found& found = *reply.add_joints();
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

v1::ListFramesReply WorldRegistry::list_frames(const v1::ListFramesRequest& request) const {
  const std::uint64_t wanted = request.limit() == 0 ? kFoundBodiesDefault : request.limit();
  const std::size_t limit = std::min(wanted, kFoundBodiesMax);
  v1::ListFramesReply reply;
  for (const auto& [name, entry] : frames_.with_prefix(request.name_prefix(), limit + 1)) {
    if (reply.frames_size() == static_cast<int>(limit)) {
      reply.set_truncated(true);
      break;
    }
    v1::ListFramesReply::Found& found = *reply.add_frames();
    found.mutable_frame()->set_name(std::string(name));
    found.mutable_frame()->set_body(entry->body.value);
    *found.mutable_frame()->mutable_pose() = to_proto(entry->pose);
    found.set_body(bodies_.at(entry->body).name);
  }
  return reply;
}

v1::FindBodiesReply WorldRegistry::find_bodies(const v1::FindBodiesRequest& request) const {
  const std::uint64_t wanted = request.limit() == 0 ? kFoundBodiesDefault : request.limit();
  const std::size_t limit = std::min(wanted, kFoundBodiesMax);
  const std::string_view prefix = request.name_prefix();
  std::vector<BodyId> ids;
  const auto consider = [&](BodyId id, const Entry& entry) {
    if (request.only_static() && entry.properties.motion != Motion::kStatic) return;
    if (entry.name.starts_with(prefix)) ids.push_back(id);
  };
  if (!request.ids().empty()) {
    for (const std::uint64_t id : std::set<std::uint64_t>(request.ids().begin(), request.ids().end())) {
      if (const Entry* entry = find(BodyId{id})) consider(BodyId{id}, *entry);
    }
  } else if (prefix.empty()) {
    for (auto body = bodies_.begin(); body != bodies_.end() && ids.size() <= limit; ++body) {
      consider(body->first, body->second);
    }
  } else {
    for (auto name = names_.lower_bound(prefix); name != names_.end() && name->first.starts_with(prefix);
         ++name) {
      consider(name->second, bodies_.at(name->second));
    }
    std::sort(ids.begin(), ids.end());
  }
  v1::FindBodiesReply reply;
  reply.set_truncated(ids.size() > limit);
  if (ids.size() > limit) ids.resize(limit);
  std::size_t shape_bytes = 0;
  for (const BodyId id : ids) {
    if (shape_bytes > kReplyShapeBytesMax) {
      reply.set_truncated(true);
      break;
    }
    const Entry& entry = bodies_.at(id);
    v1::FindBodiesReply::Found& found = *reply.add_bodies();
    found.set_id(id.value);
    found.set_name(entry.name);
    *found.mutable_properties() = to_proto(entry.properties);
    const ShapeId shape = entry.properties.shape;
    if (request.with_shapes() && !reply.shapes().contains(shape)) {
      v1::Shape& message = (*reply.mutable_shapes())[shape];
      message = to_proto(*shapes_.ref(shape));
      shape_bytes += message.ByteSizeLong();
    }
  }
  return reply;
}

}  // namespace tessera
