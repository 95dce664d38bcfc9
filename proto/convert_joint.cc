#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <cstdint>
#include <string>

#include "lpss/model/checks.h"
#include "proto/convert.h"

namespace tessera {
namespace {

// The kinds have the same numbers on both sides.
static_assert(static_cast<int>(JointType::kFixed) == v1::JOINT_FIXED);
static_assert(static_cast<int>(JointType::kRevolute) == v1::JOINT_REVOLUTE);
static_assert(static_cast<int>(JointType::kPrismatic) == v1::JOINT_PRISMATIC);
static_assert(static_cast<int>(JointType::kBall) == v1::JOINT_BALL);
static_assert(static_cast<int>(JointType::kUniversal) == v1::JOINT_UNIVERSAL);
static_assert(static_cast<int>(JointType::kScrew) == v1::JOINT_SCREW);
static_assert(static_cast<int>(DriveMode::kFree) == v1::JointDrive::FREE);
static_assert(static_cast<int>(DriveMode::kVelocity) == v1::JointDrive::VELOCITY);
static_assert(static_cast<int>(DriveMode::kPosition) == v1::JointDrive::POSITION);
static_assert(static_cast<int>(DriveMode::kEffort) == v1::JointDrive::EFFORT);
static_assert(static_cast<int>(DriveMode::kServo) == v1::JointDrive::SERVO);

v1::AxisMimic mimic_to_proto(const AxisMimic& mimic) {
  v1::AxisMimic result;
  result.set_leader(mimic.leader.value);
  result.set_axis(mimic.axis + 1u);
  result.set_multiplier(mimic.multiplier);
  result.set_reference(mimic.reference);
  result.set_offset(mimic.offset);
  return result;
}

absl::StatusOr<AxisMimic> mimic_from_proto(const v1::AxisMimic& mimic) {
  if (mimic.axis() < 1 || mimic.axis() > JointProperties{}.axes.size()) {
    return refused("mimic axis = ", mimic.axis(), " must be 1 or 2");
  }
  return AxisMimic{JointId{mimic.leader()}, static_cast<std::uint8_t>(mimic.axis() - 1), mimic.multiplier(),
                   mimic.reference(), mimic.offset()};
}

v1::JointAxis axis_to_proto(const JointAxis& axis) {
  v1::JointAxis result;
  if (axis.lower != -kUnbounded) result.set_lower(axis.lower);
  if (axis.upper != kUnbounded) result.set_upper(axis.upper);
  if (axis.velocity_max != kUnbounded) result.set_velocity_max(axis.velocity_max);
  if (axis.effort_max != kUnbounded) result.set_effort_max(axis.effort_max);
  result.set_damping(axis.damping);
  result.set_friction(axis.friction);
  result.set_spring_stiffness(axis.spring_stiffness);
  result.set_spring_reference(axis.spring_reference);
  result.set_armature(axis.armature);
  if (axis.mimic.is_set()) *result.mutable_mimic() = mimic_to_proto(axis.mimic);
  return result;
}

absl::StatusOr<JointAxis> axis_from_proto(const v1::JointAxis& axis) {
  JointAxis result;
  if (axis.has_lower()) result.lower = axis.lower();
  if (axis.has_upper()) result.upper = axis.upper();
  if (axis.has_velocity_max()) result.velocity_max = axis.velocity_max();
  if (axis.has_effort_max()) result.effort_max = axis.effort_max();
  result.damping = axis.damping();
  result.friction = axis.friction();
  result.spring_stiffness = axis.spring_stiffness();
  result.spring_reference = axis.spring_reference();
  result.armature = axis.armature();
  if (!axis.has_mimic()) return result;
  const absl::StatusOr<AxisMimic> mimic = mimic_from_proto(axis.mimic());
  if (!mimic.ok()) return mimic.status();
  result.mimic = *mimic;
  return result;
}

}  // namespace

v1::JointProperties to_proto(const JointProperties& properties) {
  v1::JointProperties result;
  result.set_type(static_cast<v1::JointType>(properties.type));
  result.set_parent(properties.parent.value);
  result.set_child(properties.child.value);
  *result.mutable_anchor() = to_proto(properties.anchor);
  *result.mutable_in_parent() = to_proto(properties.in_parent);
  *result.mutable_in_child() = to_proto(properties.in_child);
  for (int n = 0; n < axis_count(properties.type); ++n) {
    *result.add_axes() = axis_to_proto(properties.axes[n]);
  }
  result.set_pitch(properties.pitch);
  result.set_bodies_collide(properties.bodies_collide);
  return result;
}

v1::JointDrive to_proto(const JointDrive& drive) {
  v1::JointDrive result;
  result.set_mode(static_cast<v1::JointDrive::Mode>(drive.mode));
  result.set_target(drive.target);
  result.set_stiffness(drive.stiffness);
  result.set_damping(drive.damping);
  result.set_velocity(drive.velocity);
  result.set_effort(drive.effort);
  return result;
}

v1::Joint to_proto(const JointDescription& joint) {
  v1::Joint result;
  result.set_name(joint.name);
  *result.mutable_properties() = to_proto(joint.properties);
  for (const JointDrive& drive : joint.drives) *result.add_drives() = to_proto(drive);
  return result;
}

absl::StatusOr<JointProperties> from_proto(const v1::JointProperties& properties) {
  if (!v1::JointType_IsValid(properties.type())) {
    return refused("type = ", static_cast<int>(properties.type()), " must be 0 (fixed) to 5 (screw)");
  }
  JointProperties result;
  result.type = static_cast<JointType>(properties.type());
  result.parent = BodyId{properties.parent()};
  result.child = BodyId{properties.child()};
  result.anchor = from_proto(properties.anchor());
  result.in_parent = from_proto(properties.in_parent());
  result.in_child = from_proto(properties.in_child());
  if (properties.axes_size() > axis_count(result.type)) {
    return refused("the number of axes, ", properties.axes_size(), ", must be at most ",
                   axis_count(result.type), " for a joint of this type");
  }
  for (int n = 0; n < properties.axes_size(); ++n) {
    const absl::StatusOr<JointAxis> axis = axis_from_proto(properties.axes(n));
    if (!axis.ok()) return in(absl::StrCat("axis ", n + 1), axis.status());
    result.axes[n] = *axis;
  }
  result.pitch = properties.pitch();
  result.bodies_collide = properties.bodies_collide();
  return result;
}

absl::StatusOr<JointDrive> from_proto(const v1::JointDrive& drive) {
  if (!v1::JointDrive::Mode_IsValid(drive.mode())) {
    return refused("mode = ", static_cast<int>(drive.mode()), " must be 0 (free) to 4 (servo)");
  }
  return JointDrive{static_cast<DriveMode>(drive.mode()),
                    drive.target(),
                    drive.stiffness(),
                    drive.damping(),
                    drive.velocity(),
                    drive.effort()};
}

absl::StatusOr<JointDrives> drives_from_proto(
    const google::protobuf::RepeatedPtrField<v1::JointDrive>& drives) {
  JointDrives result;
  if (drives.size() > static_cast<int>(result.size())) {
    return refused("the number of drives, ", drives.size(), ", must be at most ", result.size());
  }
  for (int n = 0; n < drives.size(); ++n) {
    const absl::StatusOr<JointDrive> drive = from_proto(drives[n]);
    if (!drive.ok()) return in(absl::StrCat("drive of axis ", n + 1), drive.status());
    result[n] = *drive;
  }
  return result;
}

absl::StatusOr<JointDescription> from_proto(const v1::Joint& joint) {
  const std::string title = absl::StrCat("joint '", joint.name(), "'");
  if (!joint.has_properties()) return refused(title, ": properties must be set");
  const absl::StatusOr<JointProperties> properties = from_proto(joint.properties());
  if (!properties.ok()) return in(title, properties.status());
  const absl::StatusOr<JointDrives> drives = drives_from_proto(joint.drives());
  if (!drives.ok()) return in(title, drives.status());
  return JointDescription{joint.name(), *properties, *drives};
}

}  // namespace tessera
