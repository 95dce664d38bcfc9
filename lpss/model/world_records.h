// From how a world is described to how it is simulated, and back: descriptions have body frames, records have
// centre frames and sectors.
#pragma once

#include <absl/status/statusor.h>

#include <vector>

#include "lpss/model/body.h"
#include "lpss/model/joint.h"
#include "lpss/model/world_description.h"

namespace tessera {

// The bodies of a description as records, in the order of their ids: the i-th body gets the id i + 1. Errors
// as validate(); nothing else can fail.
absl::StatusOr<std::vector<BodyRecord>> records_of(const WorldDescription& world);

// The record of one body that is described in the frame of a world; the id is left out. Errors as
// canonical().
absl::StatusOr<BodyRecord> record_of(const BodyDescription& body, const WorldSettings& settings);

// The joints of a description, whose bodies are valid, as records: the i-th joint gets the id i + 1. Errors
// as validate_joints().
absl::StatusOr<std::vector<JointRecord>> joint_records_of(const WorldDescription& world);

// A joint whose frames are given in body frames, with frames in centre frames, as it is simulated; `parent`
// is null where it is the world. OUT_OF_RANGE where its place in the world leaves the 64-bit range.
absl::StatusOr<JointProperties> joint_properties_of(const JointProperties& joint,
                                                    const BodyProperties* parent, const BodyProperties& child,
                                                    double sector_size);

// Where the body frame of a body is, for clients. Never fails for a body that lives in a world: a position
// that would leave the range stays in its home sector's frame.
WorldPose body_pose(const SectorIndex& home, const BodyState& state, const Pose& centre_frame,
                    double sector_size);
WorldPose body_pose(const BodyRecord& record, double sector_size);

}  // namespace tessera
