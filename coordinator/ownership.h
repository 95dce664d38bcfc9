// Rights by body: requests with an owner are limited to the bodies that this owner owns.
#pragma once

#include <absl/status/status.h>

#include <string>

#include "coordinator/world_registry.h"
#include "lpss/tick/messages.h"

namespace tessera {

// PERMISSION_DENIED where `owner` is not empty and does not own the body, which exists; both bodies of a
// joint (the world is everybody's); what a command of servers is about, in a registry that has not carried it
// out.
absl::Status may_command(const std::string& owner, BodyId body, const WorldRegistry& world);
absl::Status may_command(const std::string& owner, const JointRecord& joint, const WorldRegistry& world);
absl::Status may_give(const std::string& owner, const Command& command, const WorldRegistry& world);

// Likewise where a program of a body that is spawned acts on those of others.
absl::Status may_have(const std::string& owner, const ProgramRecord& program);

}  // namespace tessera
