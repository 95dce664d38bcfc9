// Joints: from libsdformat's to ours.
#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <optional>
#include <sdf/Joint.hh>
#include <string>

#include "lpss/model/joint.h"
#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera {

// What libsdformat has no word for, in a <joint> that has been made ready for it.
inline constexpr absl::string_view kKeptDrives = "tessera:drives";
inline constexpr absl::string_view kKeptThreadPitch = "tessera:screw_thread_pitch";

// Makes a <joint> of a file ready: <tessera:drive> and SDF 1.10's <screw_thread_pitch> survive in it.
// INVALID_ARGUMENT, naming the place, for what they must not say.
absl::Status prepare_joint(xml::Element& joint);

// SDF's word for a type of joint: "revolute".
const char* type_name(sdf::JointType type);

// A joint without its place and its bodies.
struct JointKind {
  JointProperties properties;  // type, axes and pitch
  JointDrives drives;
  Eigen::Quaterniond axes = Eigen::Quaterniond::Identity();  // our joint frame, x along the axis, in SDF's
};

// None for a joint that cannot be simulated; `notices` say what is changed or left out.
absl::StatusOr<std::optional<JointKind>> read_joint(const sdf::Joint& joint, Notices& notices);

// The same joint with parent and child exchanged: its frame is to be turned by what is returned, so that its
// coordinates stay what they were. Those of a universal joint change places.
Eigen::Quaterniond exchange_sides(JointProperties& properties, JointDrives& drives);

}  // namespace tessera
