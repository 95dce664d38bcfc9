#include "coordinator/command_list.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include "coordinator/command_checks.h"
#include "coordinator/element_name.h"
#include "coordinator/limits.h"
#include "coordinator/ownership.h"
#include "lpss/model/checks.h"

namespace tessera {
namespace {

using ClientCommands = google::protobuf::RepeatedPtrField<v1::Command>;

class CommandList {
 public:
  CommandList(WorldRegistry& registry, Tick at, std::string owner, std::size_t shape_bytes_max)
      : registry_(registry), at_(at), owner_(std::move(owner)), shape_bytes_max_(shape_bytes_max) {
    given_.applied.set_tick(at);
  }

  absl::Status give(int place, const v1::Command& command) {
    switch (command.kind_case()) {
      case v1::Command::kSpawn:
        return spawn(place, command.spawn());
      case v1::Command::kRemove:
        return remove(command.remove());
      case v1::Command::kAddJoint:
        return add_joint(place, command.add_joint());
      default:
        break;
    }
    absl::StatusOr<std::vector<Command>> commands = checked(command, registry_);
    if (!commands.ok()) return commands.status();
    for (const Command& each : *commands) {
      if (absl::Status status = push(each); !status.ok()) return status;
    }
    return command.has_set_properties() ? set_tags(command.set_properties()) : absl::OkStatus();
  }

  GivenCommands finish() { return std::move(given_); }

 private:
  // As servers carry it out, for it is carried out on the registry.
  absl::Status push(const Command& command) {
    if (absl::Status status = may_give(owner_, command, registry_); !status.ok()) return status;
    registry_.apply(command, at_);
    given_.commands.append(command);
    return absl::OkStatus();
  }

  // Of a command that has been checked.
  absl::Status set_tags(const v1::SetProperties& command) {
    if (!command.has_user_data() && !command.has_owner()) return absl::OkStatus();
    const BodyId id = *registry_.resolve(command.body());
    if (absl::Status status = may_command(owner_, id, registry_); !status.ok()) return status;
    BodyTags tags = registry_.find(id)->tags;
    if (command.has_user_data()) tags.user_data = command.user_data();
    if (command.has_owner()) {
      if (!owner_.empty())
        return absl::PermissionDeniedError("owner: only a request without an owner may change it");
      tags.owner = command.owner();
    }
    if (absl::Status status = validate(tags); !status.ok()) return status;
    registry_.set_tags(id, std::move(tags));
    return absl::OkStatus();
  }

  absl::Status spawn(int place, const v1::Spawn& spawn) {
    if (!owner_.empty() && !spawn.model().modules().empty())
      return absl::PermissionDeniedError("model: only a request without an owner may bring modules");
    absl::StatusOr<WorldRegistry::Spawned> spawned = registry_.spawn(spawn, at_, owner_, shape_bytes_max_);
    if (!spawned.ok()) return spawned.status();
    for (const BodyRecord& body : spawned->bodies) {
      for (const ProgramRecord& program : body.programs) {
        if (absl::Status status = may_have(owner_, program); !status.ok()) return status;
      }
    }
    v1::Created& created = *given_.applied.add_created();
    created.set_command(place);
    created.set_first_body(spawned->bodies.front().id.value);
    created.set_bodies(spawned->bodies.size());
    if (!spawned->joints.empty()) created.set_first_joint(spawned->joints.front().id.value);
    created.set_joints(spawned->joints.size());
    for (const BodyRecord& body : spawned->bodies) given_.commands.append(SpawnBody{body});
    // What follows others comes after them.
    std::vector<bool> is_added(spawned->joints.size());
    for (std::size_t n = 0; n < spawned->joints.size(); ++n) add(spawned->joints, n, is_added);
    std::ranges::move(spawned->new_shapes, std::back_inserter(given_.new_shapes));
    std::ranges::move(spawned->new_modules, std::back_inserter(given_.new_modules));
    return absl::OkStatus();
  }

  void add(const std::vector<JointRecord>& joints, std::size_t n, std::vector<bool>& is_added) {
    if (is_added[n]) return;
    is_added[n] = true;
    for (const JointAxis& axis : axes_of(joints[n].properties)) {
      if (axis.mimic.is_set()) add(joints, axis.mimic.leader.value - joints.front().id.value, is_added);
    }
    given_.commands.append(registry_.addition_of(joints[n]));
  }

  absl::Status remove(const v1::Remove& removal) {
    if (removal.what_case() == v1::Remove::kPrefix) {
      if (removal.prefix().empty()) return refused("prefix must not be empty");
      const std::vector<BodyId> ids = registry_.with_prefix(removal.prefix());
      if (ids.empty()) {
        return absl::NotFoundError(
            absl::StrCat("there is no body whose name begins with '", removal.prefix(), "'"));
      }
      for (const BodyId id : ids) {
        if (absl::Status status = push(registry_.removal_of(id)); !status.ok()) return status;
      }
      return absl::OkStatus();
    }
    const absl::StatusOr<BodyId> id = registry_.resolve(removal.body());
    if (!id.ok()) return id.status();
    return push(registry_.removal_of(*id));
  }

  absl::Status add_joint(int place, const v1::AddJoint& addition) {
    const absl::StatusOr<JointRecord> joint = registry_.add_joint(addition);
    if (!joint.ok()) return joint.status();
    if (absl::Status status = may_command(owner_, *joint, registry_); !status.ok()) return status;
    v1::Created& created = *given_.applied.add_created();
    created.set_command(place);
    created.set_first_joint(joint->id.value);
    created.set_joints(1);
    given_.commands.append(registry_.addition_of(*joint));
    return absl::OkStatus();
  }

  WorldRegistry& registry_;
  const Tick at_;
  const std::string owner_;
  const std::size_t shape_bytes_max_;
  GivenCommands given_;
};

}  // namespace

absl::StatusOr<GivenCommands> give(const ClientCommands& list, WorldRegistry& registry, Tick at,
                                   const std::string& owner, std::size_t shape_bytes_max) {
  if (absl::Status status = validate(BodyTags{owner, {}}); !status.ok()) return status;
  if (list.size() > kCommandsPerListMax)
    return refused("commands: ", list.size(), " elements must be at most ", kCommandsPerListMax);
  CommandList commands(registry, at, owner, shape_bytes_max);
  for (int place = 0; place < list.size(); ++place) {
    if (absl::Status status = commands.give(place, list[place]); !status.ok())
      return at_element(status, "commands", place, list[place], list.size());
  }
  return commands.finish();
}

v1::RecordedCommands next_record(const WorldRegistry& registry, Tick at) {
  const WorldCatalogue next = registry.next_ids();
  v1::RecordedCommands recorded;
  recorded.set_tick(at);
  recorded.set_next_body(next.next_body.value);
  recorded.set_next_joint(next.next_joint.value);
  return recorded;
}

absl::StatusOr<GivenCommands> give_again(const v1::RecordedCommands& recorded, WorldRegistry& registry) {
  const WorldCatalogue next = registry.next_ids();
  if (next.next_body.value != recorded.next_body() || next.next_joint.value != recorded.next_joint()) {
    return absl::InternalError(absl::StrCat("the next body and joint have the ids ", next.next_body.value,
                                            " and ", next.next_joint.value, ", but the log has ",
                                            recorded.next_body(), " and ", recorded.next_joint()));
  }
  absl::StatusOr<GivenCommands> given =
      give(recorded.commands(), registry, recorded.tick(), recorded.owner());
  if (given.ok()) {
    registry.keep();
  } else {
    registry.roll_back();
  }
  return given;
}

}  // namespace tessera
