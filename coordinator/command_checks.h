// Checks clients' commands against the world and turns them into commands of a tick.
#pragma once

#include <absl/status/statusor.h>

#include <vector>

#include "command.pb.h"
#include "coordinator/world_registry.h"
#include "lpss/tick/messages.h"

namespace tessera {

// What servers are to do for a command that makes neither bodies nor joints and removes no bodies, in this
// order. Errors name the field and the bound: NOT_FOUND for a body or joint that does not exist,
// INVALID_ARGUMENT for a value that is not finite, is out of bounds or does not suit the kind of body,
// FAILED_PRECONDITION for a teleport of a body that joints hold, OUT_OF_RANGE for a position outside the
// 64-bit range of sectors.
absl::StatusOr<std::vector<Command>> checked(const v1::Command& command, const WorldRegistry& world);

}  // namespace tessera
