// Checks clients' requests against the world and turns them into commands of a tick.
#pragma once

#include <absl/status/statusor.h>

#include <optional>

#include "cluster.pb.h"
#include "coordinator/world_registry.h"
#include "lpss/tick/messages.h"
#include "tessera.pb.h"

namespace tessera {

// Errors name the field and the bound: NOT_FOUND for a body or joint that does not exist, INVALID_ARGUMENT
// for a value that is not finite, is out of bounds or does not suit the kind of body, OUT_OF_RANGE for a
// position outside the 64-bit range of sectors.
absl::StatusOr<Command> checked(const v1::RemoveRequest& request, const WorldRegistry& world);
absl::StatusOr<Command> checked(const v1::SetVelocityRequest& request, const WorldRegistry& world);
absl::StatusOr<Command> checked(const v1::ApplyImpulseRequest& request, const WorldRegistry& world);
absl::StatusOr<Command> checked(const v1::ApplyForceRequest& request, const WorldRegistry& world);
absl::StatusOr<Command> checked(const v1::TeleportRequest& request, const WorldRegistry& world);
absl::StatusOr<Command> checked(const v1::KinematicTargetRequest& request, const WorldRegistry& world);
absl::StatusOr<Command> checked(const v1::SurfaceMotionRequest& request, const WorldRegistry& world);
absl::StatusOr<Command> checked(const v1::RemoveJointRequest& request, const WorldRegistry& world);
absl::StatusOr<Command> checked(const v1::SetJointDrivesRequest& request, const WorldRegistry& world);

// A ray in canonical form, with a direction of unit length and a mask that is not 0.
absl::StatusOr<v1::RayQuery> checked(const v1::RaycastRequest& request, const WorldRegistry& world);
absl::StatusOr<v1::NearQuery> checked(const v1::NearRequest& request, const WorldRegistry& world);

}  // namespace tessera
