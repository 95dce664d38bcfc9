// Refuses what cannot be simulated, with the name of the element and the bound, before anything is touched.
#pragma once

#include <absl/status/status.h>

#include <span>

#include "lpss/model/limits.h"
#include "lpss/model/world_description.h"

namespace tessera {

// The largest sector edge (m) at which every point of a sector's engine world still resolves
// kResolutionWanted: L <= 2 r / (3 sqrt(3)), where r is the distance from the origin up to which neighbouring
// numbers of that precision are no farther apart than that. Clones and late leavers may stand in the 26
// neighbours, so the farthest corner is 1.5 sqrt(3) L away.
double precision_limit(Precision precision);

// Each returns OK, or INVALID_ARGUMENT (OUT_OF_RANGE for positions that leave the 64-bit range) with a
// message that names the element and the bound. `name` is what the message calls it.
absl::Status validate(const WorldSettings& settings);
absl::Status validate(const Shape& shape, const std::string& name);
absl::Status validate(const BodyDescription& body, const Shape& shape, const WorldSettings& settings);

// The frames of a world that move; the keys of their paths have all velocities.
absl::Status validate_frames(const WorldSettings& settings);

// Whether the sector belongs to a frame of the world.
absl::Status known_frame(const SectorIndex& sector, const WorldSettings& settings);

// A body that carries a frame stays in the frame that this one moves in.
absl::Status carrier_home(const SectorIndex& sector, BodyId body, const WorldSettings& settings);

// A joint between bodies that exist; `parent` is null where the joint ties its child to the world.
absl::Status validate(const JointDescription& joint, const BodyProperties* parent,
                      const BodyProperties& child, const WorldSettings& settings);

// A frame on one of so many bodies.
absl::Status validate(const FrameDescription& frame, std::size_t bodies);

// What drives a joint of that type.
absl::Status validate(const JointDrives& drives, JointType type);

// What an axis follows, of a leader of that type.
absl::Status validate_mimic(const AxisMimic& mimic, JointType leader);

// All joints of a world whose bodies are valid: each one, that its bodies exist and that its two frames are
// no farther apart than L, unique names, and that leaders exist and follow nothing that follows them.
absl::Status validate_joints(const WorldDescription& world);

// All of a world: its settings, every shape, body and joint, unique names, the limits.
absl::Status validate(const WorldDescription& world);

}  // namespace tessera
