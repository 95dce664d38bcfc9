// Converts libsdformat's joints to ours.
#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <sdf/Joint.hh>
#include <sdf/JointAxis.hh>
#include <string>
#include <vector>

#include "lpss/model/joint.h"
#include "worlds/loader/joint_followers.h"
#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera {

// Data that libsdformat does not support, in a <joint> that has been prepared for it.
inline constexpr absl::string_view kKeptDrives = "tessera:drives";
inline constexpr absl::string_view kKeptArmatures = "tessera:armatures";
inline constexpr absl::string_view kKeptThreadPitch = "tessera:screw_thread_pitch";

// Prepares a <joint> of a file so that <tessera:drive>, <tessera:armature>, SDF 1.10's
// <screw_thread_pitch> and SDF 1.11's <mimic> survive parsing. INVALID_ARGUMENT, naming the place, if they
// are invalid.
absl::Status prepare_joint(xml::Element& joint);

// SDF's name of a type of joint: "revolute".
const char* type_name(sdf::JointType type);

// A joint without its position and its bodies.
struct JointKind {
  JointProperties properties;  // type, axes and pitch
  JointDrives drives;
  std::vector<MimicByName> mimics;
  Eigen::Quaterniond axes = Eigen::Quaterniond::Identity();  // our joint frame, x along the axis, in SDF's
};

// The direction of an axis in SDF's joint frame; z without an axis.
absl::StatusOr<Eigen::Vector3d> direction_of(const sdf::JointAxis* axis);

// None for an unsupported joint; `notices` gets what is changed or left out.
absl::StatusOr<std::optional<JointKind>> read_joint(const sdf::Joint& joint, Notices& notices);

// Sets the limits of an angle, which is known up to whole turns only: a value beyond half a turn is not a
// limit, which `notices` gets.
void set_angle_limits(double lower, double upper, JointAxis& axis, Notices& notices);

// The rotation whose x is `x` and whose y is as near to `y` as can be; without `y`, the rest is the same for
// the same x.
Eigen::Quaterniond frame_along(const Eigen::Vector3d& x, const Eigen::Vector3d& y);
Eigen::Quaterniond frame_along(const Eigen::Vector3d& x);

// `pose`, turned about its own origin.
Pose turned(const Pose& pose, const Eigen::Quaterniond& by);

// The same joint with parent and child exchanged, its frames too, which turn, so that its coordinates stay
// the same. Those of a universal joint are exchanged.
void exchange_sides(JointProperties& properties, JointDrives& drives);

}  // namespace tessera
