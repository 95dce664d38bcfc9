// Conversion between messages and the types of lpss. Input is checked here for what a type cannot represent
// (absent fields, unknown kinds, counts); lpss/model/validate.h checks bounds.
#pragma once

#include <absl/status/statusor.h>

#include "lpss/grid/world_position.h"
#include "lpss/model/body.h"
#include "lpss/model/divergence.h"
#include "lpss/model/joint.h"
#include "lpss/model/shape.h"
#include "lpss/model/world_description.h"
#include "tessera.pb.h"
#include "world.pb.h"

namespace tessera {

// to_proto() is lossless: from_proto() of its result is the same value, bit for bit. Errors are
// INVALID_ARGUMENT and name the field.
v1::SectorIndex to_proto(const SectorIndex& sector);
v1::Vector3 to_proto(const Eigen::Vector3d& vector);
v1::Quaternion to_proto(const Eigen::Quaterniond& quaternion);
v1::WorldPosition to_proto(const WorldPosition& position);
v1::WorldPose to_proto(const WorldPose& pose);
v1::Pose to_proto(const Pose& pose);
v1::Shape to_proto(const Shape& shape);
v1::NumberedShape to_proto(const ShapeEntry& entry);
v1::LastingForce to_proto(const LastingForce& lasting);
v1::BodyProperties to_proto(const BodyProperties& properties);
v1::Program to_proto(const ProgramRecord& record);  // what it starts with
v1::Body to_proto(const BodyDescription& body);
v1::JointProperties to_proto(const JointProperties& properties);
v1::JointDrive to_proto(const JointDrive& drive);
v1::Joint to_proto(const JointDescription& joint);
v1::Divergence to_proto(const Divergence& divergence);
v1::WorldSettings to_proto(const WorldSettings& settings);
v1::World to_proto(const WorldDescription& world);
v1::Precision to_proto(Precision precision);

SectorIndex from_proto(const v1::SectorIndex& sector);
Eigen::Vector3d from_proto(const v1::Vector3& vector);
WorldPosition from_proto(const v1::WorldPosition& position);
WorldPose from_proto(const v1::WorldPose& pose);
Pose from_proto(const v1::Pose& pose);
absl::StatusOr<Shape> from_proto(const v1::Shape& shape);
absl::StatusOr<BodyProperties> from_proto(const v1::BodyProperties& properties);
absl::StatusOr<ProgramRecord> from_proto(const v1::Program& program);
absl::StatusOr<BodyDescription> from_proto(const v1::Body& body);
absl::StatusOr<JointProperties> from_proto(const v1::JointProperties& properties);
absl::StatusOr<JointDrive> from_proto(const v1::JointDrive& drive);
absl::StatusOr<JointDrives> drives_from_proto(
    const google::protobuf::RepeatedPtrField<v1::JointDrive>& drives);
absl::StatusOr<JointDescription> from_proto(const v1::Joint& joint);
// An unknown kind, of a newer cluster, is that of what is not finite.
Divergence from_proto(const v1::Divergence& divergence);
absl::StatusOr<WorldSettings> from_proto(const v1::WorldSettings& settings);
absl::StatusOr<WorldDescription> from_proto(const v1::World& world);
v1::Motion to_proto(Motion motion);
absl::StatusOr<Motion> from_proto(v1::Motion motion);
absl::StatusOr<Precision> from_proto(v1::Precision precision);

}  // namespace tessera
