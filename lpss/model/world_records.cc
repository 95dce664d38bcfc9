#include "lpss/model/world_records.h"

#include <absl/strings/str_cat.h>

#include "lpss/model/validate.h"

namespace tessera {
namespace {

// The centre frame of a body as it is simulated: that of a static one is its body frame.
Pose simulated_centre(const BodyProperties& properties) {
  return properties.motion == Motion::kStatic ? Pose{} : centre_frame(properties);
}

Pose normalized(const Pose& pose) { return {pose.position, pose.orientation.normalized()}; }

}  // namespace

absl::StatusOr<BodyRecord> record_of(const BodyDescription& body, const WorldSettings& settings) {
  BodyRecord record;
  record.properties = body.properties;
  if (record.properties.motion == Motion::kStatic) {
    // Nothing is ever integrated: the centre frame is the body frame.
    record.properties.centre = {};
    record.properties.principal_axes = {0, 0, 0, 1};
  }
  const absl::StatusOr<WorldPose> centre =
      compose(body.pose, centre_frame(record.properties), settings.sector_size);
  if (!centre.ok()) {
    return absl::Status(centre.status().code(),
                        absl::StrCat("body \"", body.name, "\": ", centre.status().message()));
  }
  record.home = centre->position.sector;
  Eigen::Map<Eigen::Vector3d>(record.state.position.data()) = centre->position.local;
  record.state.rotation = rotation_of(centre->orientation);
  Eigen::Map<Eigen::Vector3d>(record.state.linear_velocity.data()) = body.linear_velocity;
  Eigen::Map<Eigen::Vector3d>(record.state.angular_velocity.data()) = body.angular_velocity;
  record.programs = body.programs;
  for (ProgramRecord& program : record.programs) {
    program.start_sector = record.home;
    program.start = record.state.position;
  }
  return record;
}

absl::StatusOr<std::vector<BodyRecord>> records_of(const WorldDescription& world) {
  if (absl::Status status = validate(world); !status.ok()) return status;
  std::vector<BodyRecord> records;
  records.reserve(world.bodies.size());
  for (const BodyDescription& body : world.bodies) {
    absl::StatusOr<BodyRecord> record = record_of(body, world.settings);
    if (!record.ok()) return record.status();
    record->id = BodyId{records.size() + 1};
    records.push_back(*record);
  }
  return records;
}

absl::StatusOr<JointProperties> joint_properties_of(const JointProperties& joint,
                                                    const BodyProperties* parent, const BodyProperties& child,
                                                    double sector_size) {
  JointProperties result = joint;
  result.in_child = normalized(simulated_centre(child).inverse() * joint.in_child);
  if (parent != nullptr) {
    result.in_parent = normalized(simulated_centre(*parent).inverse() * joint.in_parent);
    result.anchor = {};
    return result;
  }
  const absl::StatusOr<WorldPosition> place = canonical(joint.anchor, joint.in_parent.position, sector_size);
  if (!place.ok()) return place.status();
  result.anchor = place->sector;
  result.in_parent = {place->local, joint.in_parent.orientation.normalized()};
  return result;
}

absl::StatusOr<std::vector<JointRecord>> joint_records_of(const WorldDescription& world) {
  if (absl::Status status = validate_joints(world); !status.ok()) return status;
  std::vector<JointRecord> records;
  records.reserve(world.joints.size());
  for (const JointDescription& joint : world.joints) {
    const BodyId parent = joint.properties.parent;
    const BodyProperties* parent_body =
        parent.value == 0 ? nullptr : &world.bodies[parent.value - 1].properties;
    const BodyProperties& child_body = world.bodies[joint.properties.child.value - 1].properties;
    const absl::StatusOr<JointProperties> properties =
        joint_properties_of(joint.properties, parent_body, child_body, world.settings.sector_size);
    if (!properties.ok()) {
      return absl::Status(properties.status().code(),
                          absl::StrCat("joint '", joint.name, "': ", properties.status().message()));
    }
    const Motion parent_motion = parent_body == nullptr ? Motion::kStatic : parent_body->motion;
    records.push_back({JointId{records.size() + 1}, *properties, parent_motion, joint.drives});
  }
  return records;
}

WorldPose body_pose(const SectorIndex& home, const BodyState& state, const Pose& centre_frame,
                    double sector_size) {
  const WorldPose centre{{home, Eigen::Vector3d(state.position.data())}, quaternion_of(state)};
  const absl::StatusOr<WorldPose> pose = compose(centre, centre_frame.inverse(), sector_size);
  return pose.ok() ? *pose : centre;
}

WorldPose body_pose(const BodyRecord& record, double sector_size) {
  return body_pose(record.home, record.state, centre_frame(record.properties), sector_size);
}

}  // namespace tessera
