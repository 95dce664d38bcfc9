#include "coordinator/ownership.h"

#include <absl/strings/str_cat.h>

#include <type_traits>
#include <variant>

namespace tessera {

absl::Status may_command(const std::string& owner, BodyId body, const WorldRegistry& world) {
  const WorldRegistry::Entry& entry = *world.find(body);
  if (owner.empty() || entry.tags.owner == owner) return absl::OkStatus();
  return absl::PermissionDeniedError(
      absl::StrCat("body '", entry.name, "': it is not owned by '", owner, "'"));
}

absl::Status may_command(const std::string& owner, const JointRecord& joint, const WorldRegistry& world) {
  const BodyId parent = joint.properties.parent;
  if (parent.value != 0) {
    if (absl::Status status = may_command(owner, parent, world); !status.ok()) return status;
  }
  return may_command(owner, joint.properties.child, world);
}

absl::Status may_give(const std::string& owner, const Command& command, const WorldRegistry& world) {
  if (owner.empty()) return absl::OkStatus();
  return std::visit(
      [&](const auto& c) -> absl::Status {
        using C = std::decay_t<decltype(c)>;
        if constexpr (std::is_same_v<C, ApplyRadialImpulse>) {
          return absl::PermissionDeniedError("it acts on bodies of all owners");
        } else if constexpr (std::is_same_v<C, SpawnBody>) {
          return may_command(owner, c.record.id, world);
        } else if constexpr (std::is_same_v<C, AddJoint>) {
          return may_command(owner, c.record, world);
        } else if constexpr (std::is_same_v<C, RemoveJoint> || std::is_same_v<C, SetDrives>) {
          return may_command(owner, world.joints().find(c.id)->record, world);
        } else {
          return may_command(owner, c.id, world);
        }
      },
      command);
}

}  // namespace tessera
