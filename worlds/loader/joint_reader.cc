#include "worlds/loader/joint_reader.h"

#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <cmath>
#include <ignition/math/eigen3/Conversions.hh>
#include <numbers>
#include <sdf/Element.hh>
#include <sdf/JointAxis.hh>
#include <utility>

#include "worlds/loader/repairs.h"
#include "worlds/loader/tessera_elements.h"

namespace tessera {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using std::numbers::pi;

// Two axes are at right angles if the cosine between them is at most this.
constexpr double kRightAngleTolerance = 1e-3;

// SDF's value for no limit; files also use 1e16 and 1e308.
constexpr double kNoLimit = 1e16;

std::optional<JointType> simulated_as(sdf::JointType type) {
  switch (type) {
    case sdf::JointType::FIXED:
      return JointType::kFixed;
    case sdf::JointType::REVOLUTE:
    case sdf::JointType::CONTINUOUS:
      return JointType::kRevolute;
    case sdf::JointType::PRISMATIC:
      return JointType::kPrismatic;
    case sdf::JointType::BALL:
      return JointType::kBall;
    case sdf::JointType::UNIVERSAL:
    case sdf::JointType::REVOLUTE2:
      return JointType::kUniversal;
    case sdf::JointType::SCREW:
      return JointType::kScrew;
    case sdf::JointType::GEARBOX:
    case sdf::JointType::INVALID:
      break;
  }
  return std::nullopt;
}

double bounded(double limit) {
  return std::abs(limit) >= kNoLimit ? std::copysign(kUnbounded, limit) : limit;
}

JointAxis axis_of(const sdf::JointAxis* from, JointType type, const std::string& joint, Notices& notices) {
  JointAxis axis;
  if (from == nullptr) return axis;
  double lower = bounded(from->Lower());
  double upper = bounded(from->Upper());
  if (lower > upper) {
    notices.count_repair(kCrossedLimits, absl::StrCat("<joint name='", joint, "'>"));
    std::swap(lower, upper);
  }
  if (type == JointType::kPrismatic) {
    axis.lower = lower;
    axis.upper = upper;
  } else {
    set_angle_limits(lower, upper, axis, notices);
  }
  if (from->Effort() >= 0) axis.effort_max = bounded(from->Effort());
  if (from->MaxVelocity() > 0) axis.velocity_max = bounded(from->MaxVelocity());
  if (from->MaxVelocity() == 0) notices.count("joint with a velocity limit of 0, taken as none");
  axis.damping = from->Damping();
  axis.friction = from->Friction();
  axis.spring_stiffness = from->SpringStiffness();
  axis.spring_reference = from->SpringReference();
  return axis;
}

// The numbers that prepare_joint() kept in an element.
std::vector<double> kept_numbers(const sdf::Joint& joint, absl::string_view name) {
  std::vector<double> result;
  if (joint.Element() == nullptr || !joint.Element()->HasElement(std::string(name))) return result;
  const std::string text = joint.Element()->GetElement(std::string(name))->Get<std::string>();
  for (const absl::string_view word : absl::StrSplit(text, ' ', absl::SkipEmpty())) {
    double number = 0;
    if (absl::SimpleAtod(word, &number)) result.push_back(number);
  }
  return result;
}

JointDrives drives_of(const sdf::Joint& joint) {
  JointDrives result;
  const std::vector<double> kept = kept_numbers(joint, kKeptDrives);
  constexpr std::size_t kNumbers = 6;  // of a drive
  if (kept.size() != kNumbers * result.size()) return result;
  const double* next = kept.data();
  for (JointDrive& drive : result) {
    drive = {static_cast<DriveMode>(next[0]), next[1], next[2], next[3], next[4], next[5]};
    next += kNumbers;
  }
  return result;
}

std::vector<MimicByName> mimics_of(const sdf::Joint& joint) {
  std::vector<MimicByName> result;
  const std::string name(kKeptMimic);
  if (joint.Element() == nullptr || !joint.Element()->HasElement(name)) return result;
  for (sdf::ElementPtr kept = joint.Element()->GetElement(name); kept != nullptr;
       kept = kept->GetNextElement(name)) {
    if (const std::optional<MimicByName> mimic = mimic_in(kept->Get<std::string>())) result.push_back(*mimic);
  }
  return result;
}

absl::StatusOr<double> pitch_of(const sdf::Joint& joint) {
  double pitch = -1 / joint.ThreadPitch();  // that is in radians per metre, of a left-handed thread
  if (const std::vector<double> kept = kept_numbers(joint, kKeptThreadPitch); !kept.empty()) {
    pitch = kept.front() / (2 * pi);
  }
  if (std::isfinite(pitch) && pitch != 0) return pitch;
  return absl::InvalidArgumentError("the thread pitch must be finite and not 0");
}

absl::StatusOr<Quaterniond> axes_of(const sdf::Joint& joint, JointType type) {
  if (type == JointType::kFixed || type == JointType::kBall) return Quaterniond::Identity();
  const absl::StatusOr<Vector3d> first = direction_of(joint.Axis(0));
  if (!first.ok() || type != JointType::kUniversal) {
    if (!first.ok()) return first.status();
    return frame_along(*first);
  }
  const absl::StatusOr<Vector3d> second = direction_of(joint.Axis(1));
  if (!second.ok()) return second.status();
  if (std::abs(first->dot(*second)) > kRightAngleTolerance) {
    return absl::UnimplementedError("its axes are not at right angles");
  }
  return frame_along(*first, *second);
}

}  // namespace

void set_angle_limits(double lower, double upper, JointAxis& axis, Notices& notices) {
  if (lower >= -pi && upper <= pi) {
    axis.lower = lower;
    axis.upper = upper;
    return;
  }
  if (lower <= -pi && upper >= pi) {
    if (std::isfinite(lower) || std::isfinite(upper)) {
      notices.count("joint whose limits are a full turn or more apart: turns freely");
    }
    return;
  }
  notices.count("joint with a limit beyond half a turn: it stops at half a turn");
  axis.lower = std::max(lower, -pi);
  axis.upper = std::min(upper, pi);
}

Quaterniond frame_along(const Vector3d& x, const Vector3d& y) {
  Eigen::Matrix3d axes;
  axes.col(0) = x;
  axes.col(1) = (y - x * x.dot(y)).normalized();
  axes.col(2) = x.cross(axes.col(1));
  return Quaterniond(axes).normalized();
}

Quaterniond frame_along(const Vector3d& x) {
  int least = 0;
  x.cwiseAbs().minCoeff(&least);
  Vector3d helper = Vector3d::Unit(least);
  if (x == Vector3d::UnitX()) helper = Vector3d::UnitY();
  return frame_along(x, helper);
}

absl::StatusOr<Vector3d> direction_of(const sdf::JointAxis* axis) {
  if (axis == nullptr) return Vector3d(Vector3d::UnitZ());
  ignition::math::Vector3d xyz = axis->Xyz();
  if (!axis->XyzExpressedIn().empty()) {
    const sdf::Errors errors = axis->ResolveXyz(xyz);
    if (!errors.empty()) return absl::InvalidArgumentError(errors.front().Message());
  }
  const Vector3d direction = ignition::math::eigen3::convert(xyz);
  const double norm = direction.norm();
  if (std::isfinite(norm) && norm > 0) return Vector3d(direction / norm);
  return absl::InvalidArgumentError("the <xyz> of its axis must be finite and not 0 0 0");
}

absl::Status prepare_joint(xml::Element& joint) {
  const absl::StatusOr<JointDrives> drives = take_drives(joint);
  if (!drives.ok()) return drives.status();
  const absl::StatusOr<std::array<double, 2>> armatures = take_armatures(joint);
  if (!armatures.ok()) return armatures.status();
  for (const xml::Element* child = joint.FirstChildElement(); child != nullptr;
       child = child->NextSiblingElement()) {
    if (!absl::StartsWith(child->Name(), "tessera:")) continue;
    return xml::invalid(*child, "unknown or misplaced tessera: element");
  }
  if (*drives != JointDrives{}) {
    std::string text;
    for (const JointDrive& drive : *drives) {
      absl::StrAppendFormat(&text, "%d %.17g %.17g %.17g %.17g %.17g ", static_cast<int>(drive.mode),
                            drive.target, drive.stiffness, drive.damping, drive.velocity, drive.effort);
    }
    joint.InsertNewChildElement(kKeptDrives.data())->SetText(text.c_str());
  }
  if (*armatures != std::array<double, 2>{}) {
    const std::string text = absl::StrFormat("%.17g %.17g", armatures->front(), armatures->back());
    joint.InsertNewChildElement(kKeptArmatures.data())->SetText(text.c_str());
  }
  if (absl::Status status = keep_mimics(joint); !status.ok()) return status;
  if (xml::Element* pitch = joint.FirstChildElement("screw_thread_pitch")) {
    if (absl::Status status = xml::number_of(*pitch).status(); !status.ok()) return status;
    pitch->SetName(kKeptThreadPitch.data());
  }
  return absl::OkStatus();
}

const char* type_name(sdf::JointType type) {
  switch (type) {
    case sdf::JointType::BALL:
      return "ball";
    case sdf::JointType::CONTINUOUS:
      return "continuous";
    case sdf::JointType::FIXED:
      return "fixed";
    case sdf::JointType::GEARBOX:
      return "gearbox";
    case sdf::JointType::PRISMATIC:
      return "prismatic";
    case sdf::JointType::REVOLUTE:
      return "revolute";
    case sdf::JointType::REVOLUTE2:
      return "revolute2";
    case sdf::JointType::SCREW:
      return "screw";
    case sdf::JointType::UNIVERSAL:
      return "universal";
    case sdf::JointType::INVALID:
      break;
  }
  return "unknown";
}

absl::StatusOr<std::optional<JointKind>> read_joint(const sdf::Joint& joint, Notices& notices) {
  const std::optional<JointType> type = simulated_as(joint.Type());
  if (!type) {
    notices.count_joint_left_out(type_name(joint.Type()));
    return std::nullopt;
  }
  JointKind result;
  const absl::StatusOr<Quaterniond> axes = axes_of(joint, *type);
  if (axes.status().code() == absl::StatusCode::kUnimplemented) {
    notices.count_joint_left_out(absl::StrCat(type_name(joint.Type()), " with axes not at right angles"));
    return std::nullopt;
  }
  if (!axes.ok()) return axes.status();
  result.axes = *axes;
  result.properties.type = *type;
  for (int n = 0; n < axis_count(*type); ++n) {
    result.properties.axes[n] = axis_of(joint.Axis(n), *type, joint.Name(), notices);
  }
  const std::vector<double> armatures = kept_numbers(joint, kKeptArmatures);
  for (std::size_t n = 0; n < armatures.size(); ++n) {
    if (armatures[n] != 0 && n >= axes_of(result.properties).size())
      return absl::InvalidArgumentError(absl::StrCat("<tessera:armature>: it has no axis ", n + 1));
    result.properties.axes[n].armature = armatures[n];
  }
  if (*type == JointType::kScrew) {
    const absl::StatusOr<double> pitch = pitch_of(joint);
    if (!pitch.ok()) return pitch.status();
    result.properties.pitch = *pitch;
  }
  result.drives = drives_of(joint);
  result.mimics = mimics_of(joint);
  notices.count_joint(type_name(joint.Type()));
  return result;
}

Pose turned(const Pose& pose, const Quaterniond& by) { return {pose.position, pose.orientation * by}; }

void exchange_sides(JointProperties& properties, JointDrives& drives) {
  std::swap(properties.parent, properties.child);
  std::swap(properties.in_parent, properties.in_child);
  Quaterniond turn(0, 0, 1, 0);  // x becomes -x
  if (properties.type == JointType::kUniversal) {
    std::swap(properties.axes[0], properties.axes[1]);
    std::swap(drives[0], drives[1]);
    constexpr double kHalf = std::numbers::sqrt2 / 2;
    turn = Quaterniond(0, kHalf, -kHalf, 0);  // x becomes -y, y becomes -x
  }
  properties.in_parent = turned(properties.in_parent, turn);
  properties.in_child = turned(properties.in_child, turn);
}

}  // namespace tessera
