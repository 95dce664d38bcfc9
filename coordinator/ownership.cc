#include "coordinator/ownership.h"

#include <absl/strings/str_cat.h>

#include <cstdint>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "lpss/model/checks.h"
#include "lpss/programs/registry.h"

namespace tessera {
namespace {

// What a program is told to act on. That there is no such body or joint is no error.
absl::Status may_name(const std::string& owner, const NumberSpec& spec, double value,
                      const WorldRegistry& world) {
  const auto id = static_cast<std::uint64_t>(value);
  if (spec.unit == kBodyUnit && world.find(BodyId{id}) != nullptr)
    return in(std::string(spec.name), may_command(owner, BodyId{id}, world));
  if (const JointRegistry::Entry* joint = world.joints().find(JointId{id}); spec.unit == kJointUnit && joint)
    return in(std::string(spec.name), may_command(owner, joint->record, world));
  return absl::OkStatus();
}

absl::Status may_tell(const std::string& owner, const TellProgram& told, const WorldRegistry& world) {
  const Program* const program = find_program(world.find(told.id)->tags.programs[told.program]);
  const auto check = [&](const std::vector<std::pair<std::uint32_t, double>>& numbers,
                         std::span<const NumberSpec> table) {
    for (const auto& [place, value] : numbers) {
      if (absl::Status status = may_name(owner, table[place], value, world); !status.ok()) return status;
    }
    return absl::OkStatus();
  };
  if (absl::Status status = check(told.parameters, program->parameters()); !status.ok()) return status;
  return check(told.inputs, program->inputs());
}

}  // namespace

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
        } else if constexpr (std::is_same_v<C, TellProgram>) {
          if (absl::Status status = may_command(owner, c.id, world); !status.ok()) return status;
          return may_tell(owner, c, world);
        } else {
          return may_command(owner, c.id, world);
        }
      },
      command);
}

absl::Status may_have(const std::string& owner, const ProgramRecord& program) {
  if (owner.empty() || !find_program(program.kind)->acts_on_others()) return absl::OkStatus();
  return absl::PermissionDeniedError(absl::StrCat("program ", program.kind, " acts on bodies of all owners"));
}

}  // namespace tessera
