#include "coordinator/world_registry.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "coordinator/limits.h"
#include "lpss/grid/invariant.h"
#include "lpss/world/limits.h"
#include "lpss/world/simulation.h"
#include "lpss/world/validate.h"
#include "proto/convert.h"

namespace tessera {

WorldRegistry::WorldRegistry(WorldDescription world, std::span<const BodyRecord> records)
    : settings_(world.settings), shapes_(std::move(world.shapes)) {
  invariant(world.bodies.size() == records.size(), "every body of a world has a record");
  for (std::size_t n = 0; n < records.size(); ++n) {
    insert(records[n].id, std::move(world.bodies[n].name), records[n].properties);
    next_id_ = BodyId{records[n].id.value + 1};
  }
}

void WorldRegistry::insert(BodyId id, std::string name, const BodyProperties& properties) {
  const auto [entry, is_new] = bodies_.emplace(id, Entry{std::move(name), properties});
  invariant(is_new && names_.emplace(entry->second.name, id).second, "ids and names of bodies are unique");
}

absl::StatusOr<BodyId> WorldRegistry::resolve(const v1::BodyRef& reference) const {
  switch (reference.by_case()) {
    case v1::BodyRef::kId:
      if (bodies_.contains(BodyId{reference.id()})) return BodyId{reference.id()};
      return absl::NotFoundError(absl::StrCat("there is no body with the id ", reference.id()));
    case v1::BodyRef::kName: {
      const auto found = names_.find(reference.name());
      if (found != names_.end()) return found->second;
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
  if (next_id_.value > kBodyIdMax) {
    return absl::ResourceExhaustedError(
        absl::StrCat("all ids of bodies up to ", kBodyIdMax, " have been given"));
  }
  return absl::OkStatus();
}

std::string WorldRegistry::name_for(BodyId id) const {
  const std::string name = absl::StrCat("body_", id.value);
  std::string unique = name;
  for (int n = 2; names_.contains(unique); ++n) unique = absl::StrCat(name, "_", n);
  return unique;
}

absl::StatusOr<BodyRecord> WorldRegistry::checked_record(const BodyDescription& body) const {
  if (absl::Status status = validate(body, shapes(), settings_); !status.ok()) return status;
  return record_of(body, settings_);
}

absl::StatusOr<WorldRegistry::Spawned> WorldRegistry::spawn(const v1::SpawnRequest& request) {
  if (absl::Status status = check_room(); !status.ok()) return status;
  if (!request.has_body()) return absl::InvalidArgumentError("body must be set");
  absl::StatusOr<BodyDescription> body = from_proto(request.body());
  if (!body.ok()) return body.status();
  if (body->name.empty()) body->name = name_for(next_id_);
  if (names_.contains(body->name)) {
    return absl::AlreadyExistsError(absl::StrCat("body '", body->name, "': the name is in use"));
  }

  bool is_new_shape = false;
  if (request.has_shape()) {
    const std::string title = absl::StrCat("shape of body '", body->name, "'");
    absl::StatusOr<Shape> shape = from_proto(request.shape());
    if (!shape.ok()) {
      return absl::InvalidArgumentError(absl::StrCat(title, ": ", shape.status().message()));
    }
    if (absl::Status status = validate(*shape, title); !status.ok()) return status;
    const std::optional<ShapeId> known = shapes_.find(*shape);
    is_new_shape = !known.has_value();
    if (is_new_shape && shapes().size() >= kShapesMax) {
      return absl::ResourceExhaustedError(
          absl::StrCat("the world has ", kShapesMax, " different shapes, and may not have more"));
    }
    body->properties.shape = known.value_or(shapes_.next_id());
    if (is_new_shape) shapes_.push(*std::move(shape));
  }
  absl::StatusOr<BodyRecord> record = checked_record(*body);
  if (!record.ok()) {
    if (is_new_shape) shapes_.pop();
    return record.status();
  }

  record->id = next_id_;
  next_id_ = BodyId{next_id_.value + 1};
  insert(record->id, std::move(body->name), record->properties);
  Spawned spawned{*std::move(record), std::nullopt};
  if (is_new_shape) spawned.new_shape = request.shape();
  return spawned;
}

void WorldRegistry::remove(BodyId id) {
  const auto found = bodies_.find(id);
  if (found == bodies_.end()) return;
  names_.erase(found->second.name);
  bodies_.erase(found);
}

v1::FindBodiesReply WorldRegistry::find_bodies(const v1::FindBodiesRequest& request) const {
  const std::uint64_t wanted = request.limit() == 0 ? kFoundBodiesDefault : request.limit();
  const std::size_t limit = std::min(wanted, kFoundBodiesMax);
  std::vector<BodyId> ids;
  if (request.name_prefix().empty()) {
    for (auto body = bodies_.begin(); body != bodies_.end() && ids.size() <= limit; ++body) {
      ids.push_back(body->first);
    }
  } else {
    for (auto name = names_.lower_bound(request.name_prefix());
         name != names_.end() && name->first.starts_with(request.name_prefix()); ++name) {
      ids.push_back(name->second);
    }
    std::sort(ids.begin(), ids.end());
  }
  v1::FindBodiesReply reply;
  reply.set_truncated(ids.size() > limit);
  if (ids.size() > limit) ids.resize(limit);
  for (const BodyId id : ids) {
    const Entry& entry = bodies_.at(id);
    v1::FindBodiesReply::Found& found = *reply.add_bodies();
    found.set_id(id.value);
    found.set_name(entry.name);
    *found.mutable_properties() = to_proto(entry.properties);
  }
  return reply;
}

}  // namespace tessera
