// Checks clients' commands against the world and turns them into commands of a tick.
#pragma once

#include <absl/status/statusor.h>

#include "command.pb.h"
#include "coordinator/world_registry.h"
#include "lpss/tick/messages.h"

namespace tessera {

// Errors name the field and the bound: NOT_FOUND for a body or joint that does not exist, INVALID_ARGUMENT
// for a value that is not finite, is out of bounds or does not suit the kind of body, OUT_OF_RANGE for a
// position outside the 64-bit range of sectors.
absl::StatusOr<Command> checked(const v1::SetVelocity& command, const WorldRegistry& world);
absl::StatusOr<Command> checked(const v1::ApplyImpulse& command, const WorldRegistry& world);
absl::StatusOr<Command> checked(const v1::ApplyForce& command, const WorldRegistry& world);
absl::StatusOr<Command> checked(const v1::Teleport& command, const WorldRegistry& world);
absl::StatusOr<Command> checked(const v1::SetKinematicTarget& command, const WorldRegistry& world);
absl::StatusOr<Command> checked(const v1::SetSurfaceMotion& command, const WorldRegistry& world);
absl::StatusOr<Command> checked(const v1::SetProperties& command, const WorldRegistry& world);
absl::StatusOr<Command> checked(const v1::ApplyRadialImpulse& command, const WorldRegistry& world);
absl::StatusOr<Command> checked(const v1::RemoveJoint& command, const WorldRegistry& world);
absl::StatusOr<Command> checked(const v1::SetJointDrives& command, const WorldRegistry& world);

}  // namespace tessera
