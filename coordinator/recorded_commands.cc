#include "coordinator/recorded_commands.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "coordinator/command_checks.h"

namespace tessera {
namespace {

absl::Status other_id(std::uint64_t here, std::uint64_t recorded) {
  return absl::InternalError(
      absl::StrCat("a new body or joint has id ", here, ", but the log has ", recorded));
}

absl::StatusOr<GivenCommand> spawned(const v1::RecordedCommand& recorded, WorldRegistry& registry) {
  absl::StatusOr<WorldRegistry::Spawned> body = registry.spawn(recorded.spawn(), recorded.tick());
  if (!body.ok()) return body.status();
  if (body->record.id.value != recorded.id()) return other_id(body->record.id.value, recorded.id());
  return GivenCommand{SpawnBody{body->record}, std::move(body->new_shape)};
}

absl::StatusOr<GivenCommand> joined(const v1::RecordedCommand& recorded, WorldRegistry& registry) {
  const absl::StatusOr<JointRecord> joint = registry.add_joint(recorded.add_joint());
  if (!joint.ok()) return joint.status();
  if (joint->id.value != recorded.id()) return other_id(joint->id.value, recorded.id());
  return GivenCommand{registry.addition_of(*joint), std::nullopt};
}

absl::StatusOr<Command> checked_again(const v1::RecordedCommand& recorded, const WorldRegistry& registry) {
  using Kind = v1::RecordedCommand::RequestCase;
  switch (recorded.request_case()) {
    case Kind::kRemove:
      return checked(recorded.remove(), registry);
    case Kind::kSetVelocity:
      return checked(recorded.set_velocity(), registry);
    case Kind::kApplyImpulse:
      return checked(recorded.apply_impulse(), registry);
    case Kind::kApplyForce:
      return checked(recorded.apply_force(), registry);
    case Kind::kTeleport:
      return checked(recorded.teleport(), registry);
    case Kind::kKinematicTarget:
      return checked(recorded.kinematic_target(), registry);
    case Kind::kRemoveJoint:
      return checked(recorded.remove_joint(), registry);
    case Kind::kSetJointDrives:
      return checked(recorded.set_joint_drives(), registry);
    case Kind::kSurfaceMotion:
      return checked(recorded.surface_motion(), registry);
    case Kind::kSpawn:
    case Kind::kAddJoint:
    case Kind::REQUEST_NOT_SET:
      break;
  }
  return absl::DataLossError("unknown kind of command");
}

}  // namespace

absl::StatusOr<GivenCommand> given_again(const v1::RecordedCommand& recorded, WorldRegistry& registry) {
  if (recorded.has_spawn()) return spawned(recorded, registry);
  if (recorded.has_add_joint()) return joined(recorded, registry);
  absl::StatusOr<Command> command = checked_again(recorded, registry);
  if (!command.ok()) return command.status();
  registry.apply(*command, recorded.tick());
  return GivenCommand{*std::move(command), std::nullopt};
}

}  // namespace tessera
