// Places trees of bodies that joints hold: v1::SetState.
#pragma once

#include <absl/status/statusor.h>

#include <vector>

#include "command.pb.h"
#include "coordinator/world_registry.h"
#include "lpss/tick/messages.h"

namespace tessera {

// The teleports that place the bodies of the command and what hangs on them by its joints, in its order.
// INVALID_ARGUMENT with the body or joint and the bound, also for a body that is placed twice and for a joint
// whose parent is not placed; NOT_FOUND for a body or joint that does not exist; OUT_OF_RANGE.
absl::StatusOr<std::vector<Command>> checked(const v1::SetState& command, const WorldRegistry& world);

}  // namespace tessera
