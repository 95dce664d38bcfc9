#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "lpss/model/checks.h"
#include "lpss/model/validate.h"

namespace tessera {
namespace {

std::string title(const JointDescription& joint) { return absl::StrCat("joint '", joint.name, "'"); }

bool is_angle(JointType type) { return type != JointType::kPrismatic; }

const char* unit_of(JointType type) { return is_angle(type) ? "rad" : "m"; }

const char* effort_unit(JointType type) { return is_angle(type) ? "N m" : "N"; }

const char* gain_unit(JointType type) { return is_angle(type) ? "N m/rad" : "N/m"; }

const char* damping_unit(JointType type) { return is_angle(type) ? "N m s/rad" : "N s/m"; }

absl::Status name_check(const std::string& name) {
  if (name.empty()) return refused("a joint's name must not be empty");
  if (name.size() <= kNameBytesMax) return utf8("joint", name);
  return refused("joint '", name.substr(0, 40), "...': the name's ", name.size(), " bytes must be at most ",
                 kNameBytesMax);
}

absl::Status limits_check(const JointAxis& axis, JointType type) {
  const char* unit = unit_of(type);
  if (std::isnan(axis.lower) || std::isnan(axis.upper)) {
    return refused("limits [", axis.lower, ", ", axis.upper, "] ", unit, " must be numbers");
  }
  if (axis.lower > axis.upper || axis.lower == kUnbounded || axis.upper == -kUnbounded) {
    return refused("lower = ", axis.lower, " ", unit, " must be at most upper = ", axis.upper, " ", unit);
  }
  if (!is_angle(type)) return absl::OkStatus();
  for (const double limit : {axis.lower, axis.upper}) {
    if (std::isinf(limit) || std::abs(limit) <= std::numbers::pi) continue;
    return refused("limit = ", limit, " rad must lie within [-pi, pi] or be infinite");
  }
  return absl::OkStatus();
}

// What needs no knowledge of the leader.
absl::Status mimic_check(const AxisMimic& mimic, JointType type) {
  if (!mimic.is_set()) return absl::OkStatus();
  absl::Status status =
      bounded("mimic multiplier", mimic.multiplier, -kMimicMultiplierMax, kMimicMultiplierMax);
  if (!status.ok()) return status;
  status = bounded("mimic reference", mimic.reference, -kDriveWayMax, kDriveWayMax);
  if (!status.ok()) return status;
  return bounded("mimic offset", mimic.offset, -kDriveWayMax, kDriveWayMax, unit_of(type));
}

absl::Status axis_check(const JointAxis& axis, JointType type) {
  if (absl::Status status = limits_check(axis, type); !status.ok()) return status;
  if (!(axis.velocity_max > 0)) {
    return refused("velocity_max = ", axis.velocity_max, " ", unit_of(type), "/s must be above 0");
  }
  if (!(axis.effort_max >= 0)) return refused("effort_max = ", axis.effort_max, " must be at least 0");
  if (absl::Status status = bounded("damping", axis.damping, 0, kNoBound); !status.ok()) return status;
  if (absl::Status status = bounded("friction", axis.friction, 0, kNoBound); !status.ok()) return status;
  absl::Status status = bounded("spring_stiffness", axis.spring_stiffness, 0, kGainMax, gain_unit(type));
  if (!status.ok()) return status;
  status = bounded("spring_reference", axis.spring_reference, -kDriveWayMax, kDriveWayMax, unit_of(type));
  if (!status.ok()) return status;
  status =
      bounded("armature", axis.armature, 0, kArmatureMax, type == JointType::kPrismatic ? "kg" : "kg m^2");
  return status.ok() ? mimic_check(axis.mimic, type) : status;
}

// How far from a body's origin a joint may be: only what never moves may be large.
double reach_max(const BodyProperties* body, double sector_size) {
  return body == nullptr || body->motion == Motion::kStatic ? kStaticExtentMax : sector_size;
}

Eigen::Vector3d centre_of(const BodyProperties* body) {
  if (body == nullptr || body->motion == Motion::kStatic) return Eigen::Vector3d::Zero();
  return Eigen::Vector3d(body->centre.data());
}

absl::Status frame_check(const std::string& what, const Pose& frame, const BodyProperties* body,
                         double sector_size) {
  if (absl::Status status = finite(what, frame.position); !status.ok()) return status;
  if (absl::Status status = unit_quaternion(what, frame.orientation); !status.ok()) return status;
  if (body == nullptr) return absl::OkStatus();
  const double reach = (frame.position - centre_of(body)).norm();
  const double most = reach_max(body, sector_size);
  if (reach <= most) return absl::OkStatus();
  return refused(what, ": its distance ", reach, " m from the body's centre must be at most ", most, " m");
}

absl::Status frames_check(const JointProperties& joint, const BodyProperties* parent,
                          const BodyProperties& child, const WorldSettings& settings) {
  const double sector_size = settings.sector_size;
  if (absl::Status status = frame_check("in_parent", joint.in_parent, parent, sector_size); !status.ok()) {
    return status;
  }
  if (parent == nullptr) {
    if (absl::Status status = known_frame(joint.anchor, settings); !status.ok()) return status;
    absl::Status status = canonical(joint.anchor, joint.in_parent.position, sector_size).status();
    if (!status.ok()) return in("in_parent", status);
  }
  return frame_check("in_child", joint.in_child, &child, sector_size);
}

absl::Status velocity_check(double velocity, JointType type) {
  const double most = is_angle(type) ? kAngularSpeedMax : kSpeedMax;
  return bounded("velocity", velocity, -most, most, is_angle(type) ? "rad/s" : "m/s");
}

absl::Status position_check(double position, JointType type) {
  const double most = is_angle(type) ? std::numbers::pi : kDriveWayMax;
  return bounded("position", position, -most, most, unit_of(type));
}

absl::Status effort_check(double effort, JointType type) {
  const double most = is_angle(type) ? kTorqueMax : kForceMax;
  return bounded("effort", effort, -most, most, effort_unit(type));
}

absl::Status servo_check(const JointDrive& drive, JointType type) {
  absl::Status status = position_check(drive.target, type);
  status.Update(bounded("stiffness", drive.stiffness, 0, kGainMax, gain_unit(type)));
  status.Update(bounded("damping", drive.damping, 0, kGainMax, damping_unit(type)));
  status.Update(velocity_check(drive.velocity, type));
  status.Update(effort_check(drive.effort, type));
  return status;
}

absl::Status drive_check(const JointDrive& drive, JointType type) {
  if (drive.mode == DriveMode::kServo) return servo_check(drive, type);
  for (const auto& [name, value] :
       {std::pair{"stiffness", drive.stiffness}, std::pair{"damping", drive.damping},
        std::pair{"velocity", drive.velocity}, std::pair{"effort", drive.effort}}) {
    if (value != 0) return refused(name, " = ", value, " must be 0: only a servo has it");
  }
  switch (drive.mode) {
    case DriveMode::kFree:
    case DriveMode::kServo:
      return bounded("target", drive.target, -kNoBound, kNoBound);
    case DriveMode::kVelocity:
      return velocity_check(drive.target, type);
    case DriveMode::kPosition:
      return position_check(drive.target, type);
    case DriveMode::kEffort:
      return effort_check(drive.target, type);
  }
  return refused("mode = ", static_cast<int>(drive.mode),
                 " must be free, velocity, position, effort or servo");
}

// Bodies of a description go by their places plus one; null for 0.
const BodyDescription* body_at(const WorldDescription& world, BodyId place) {
  return place.value == 0 ? nullptr : &world.bodies[place.value - 1];
}

absl::Status bodies_check(const WorldDescription& world, const JointProperties& joint) {
  const std::size_t bodies = world.bodies.size();
  if (joint.child.value == 0 || joint.child.value > bodies) {
    return refused("child = ", joint.child.value, " must be 1 to ", bodies, ", the number of bodies");
  }
  if (joint.parent.value > bodies) {
    return refused("parent = ", joint.parent.value, " must be 0 (the world) to ", bodies,
                   ", the number of bodies");
  }
  return absl::OkStatus();
}

// The joint frame as one side has it, at the start.
absl::StatusOr<WorldPosition> start(const BodyDescription* body, const SectorIndex& anchor, const Pose& frame,
                                    double sector_size) {
  if (body == nullptr) return canonical(anchor, frame.position, sector_size);
  const absl::StatusOr<WorldPose> pose = compose(body->pose, frame, sector_size);
  if (!pose.ok()) return pose.status();
  return pose->position;
}

absl::Status gap_check(const WorldDescription& world, const JointProperties& joint) {
  const double size = world.settings.sector_size;
  const auto parent = start(body_at(world, joint.parent), joint.anchor, joint.in_parent, size);
  if (!parent.ok()) return in("in_parent", parent.status());
  const auto child = start(body_at(world, joint.child), joint.anchor, joint.in_child, size);
  if (!child.ok()) return in("in_child", child.status());
  if (parent->sector.frame != child->sector.frame) return refused("its bodies are in different frames");
  const double gap = (relative_to(*child, parent->sector, size) - parent->local).norm();
  if (gap <= size) return absl::OkStatus();
  return refused("its frames on parent and child are ", gap, " m apart, and must be at most L = ", size,
                 " m");
}

absl::Status check_in(const WorldDescription& world, const JointDescription& joint) {
  if (absl::Status status = bodies_check(world, joint.properties); !status.ok())
    return in(title(joint), status);
  const BodyDescription* parent = body_at(world, joint.properties.parent);
  const BodyDescription* child = body_at(world, joint.properties.child);
  absl::Status status =
      validate(joint, parent == nullptr ? nullptr : &parent->properties, child->properties, world.settings);
  if (!status.ok()) return status;
  return in(title(joint), gap_check(world, joint.properties));
}

}  // namespace

absl::Status validate(const JointDrives& drives, JointType type) {
  const int axes = axis_count(type);
  for (int n = 0; n < static_cast<int>(drives.size()); ++n) {
    const std::string what = absl::StrCat("drive of axis ", n + 1);
    if (absl::Status status = drive_check(drives[n], type); !status.ok()) return in(what, status);
    if (n >= axes && drives[n].mode != DriveMode::kFree) {
      return refused(what, " must be free: the joint has ", axes, " axes with a coordinate");
    }
  }
  return absl::OkStatus();
}

absl::Status validate(const JointDescription& joint, const BodyProperties* parent,
                      const BodyProperties& child, const WorldSettings& settings) {
  if (absl::Status status = name_check(joint.name); !status.ok()) return status;
  const JointProperties& properties = joint.properties;
  const std::string what = title(joint);
  if (properties.type > JointType::kScrew) {
    return refused(what, ": type = ", static_cast<int>(properties.type),
                   " must be fixed, revolute, prismatic, ball, universal or screw");
  }
  if (properties.parent == properties.child) return refused(what, ": parent and child must be two bodies");
  if (child.motion != Motion::kDynamic) {
    return refused(what, ": the child must be dynamic; exchange it with the parent, or leave the joint out");
  }
  absl::Status status = frames_check(properties, parent, child, settings);
  if (!status.ok()) return in(what, status);
  for (int n = 0; n < axis_count(properties.type); ++n) {
    status = axis_check(properties.axes[n], properties.type);
    if (!status.ok()) return in(absl::StrCat(what, ": axis ", n + 1), status);
  }
  if (!std::isfinite(properties.pitch) || (properties.type == JointType::kScrew && properties.pitch == 0)) {
    return refused(what, ": pitch = ", properties.pitch, " m/rad must be finite, and of a screw not 0");
  }
  return in(what, validate(joint.drives, properties.type));
}

absl::Status validate_mimic(const AxisMimic& mimic, JointType leader) {
  const int axes = axis_count(leader);
  if (mimic.axis < axes) return absl::OkStatus();
  return refused("mimic axis = ", mimic.axis + 1, " must be 1 to ", axes,
                 ", the number of axes of its leader with a coordinate");
}

namespace {

// The leader that the axis of a joint follows; null if none.
absl::StatusOr<const JointDescription*> leader_of(const WorldDescription& world, const AxisMimic& mimic) {
  if (!mimic.is_set()) return nullptr;
  if (mimic.leader.value > world.joints.size()) {
    return refused("mimic leader = ", mimic.leader.value, " must be 1 to ", world.joints.size(),
                   ", the number of joints");
  }
  return &world.joints[mimic.leader.value - 1];
}

absl::Status leaders_check(const WorldDescription& world, const JointDescription& joint) {
  for (int n = 0; n < axis_count(joint.properties.type); ++n) {
    const AxisMimic& mimic = joint.properties.axes[n].mimic;
    const std::string what = absl::StrCat(title(joint), ": axis ", n + 1);
    const absl::StatusOr<const JointDescription*> leader = leader_of(world, mimic);
    if (!leader.ok()) return in(what, leader.status());
    if (*leader == nullptr) continue;
    absl::Status status = validate_mimic(mimic, (*leader)->properties.type);
    if (!status.ok()) return in(what, status);
  }
  return absl::OkStatus();
}

// Following leaders from joint to joint must come to an end.
absl::Status no_circle_check(const WorldDescription& world) {
  enum class State : std::uint8_t { kNew, kOnTheWay, kDone };
  std::vector<State> states(world.joints.size(), State::kNew);
  std::vector<std::size_t> way;
  for (std::size_t start = 0; start < world.joints.size(); ++start) {
    way.assign(1, start);
    while (!way.empty()) {
      const std::size_t joint = way.back();
      if (states[joint] != State::kNew) {
        states[joint] = State::kDone;
        way.pop_back();
        continue;
      }
      states[joint] = State::kOnTheWay;
      for (const JointAxis& axis : axes_of(world.joints[joint].properties)) {
        if (!axis.mimic.is_set()) continue;
        const std::size_t leader = axis.mimic.leader.value - 1;
        if (states[leader] == State::kOnTheWay) {
          return refused(title(world.joints[joint]), ": by its mimic, it would follow itself");
        }
        if (states[leader] == State::kNew) way.push_back(leader);
      }
    }
  }
  return absl::OkStatus();
}

// Counts a joint more of each of its bodies that may move.
absl::Status number_check(const WorldDescription& world, const JointDescription& joint,
                          absl::flat_hash_map<BodyId, std::size_t>& joints_of) {
  for (const BodyId id : {joint.properties.parent, joint.properties.child}) {
    if (id.value == 0) continue;
    const BodyDescription& body = world.bodies[id.value - 1];
    if (body.properties.motion == Motion::kStatic || ++joints_of[id] <= kJointsPerBodyMax) continue;
    return refused(title(joint), ": the joints of body '", body.name, "', which may move, must be at most ",
                   kJointsPerBodyMax);
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status validate_joints(const WorldDescription& world) {
  absl::flat_hash_set<absl::string_view> names;
  names.reserve(world.joints.size());
  absl::flat_hash_map<BodyId, std::size_t> joints_of;
  for (const JointDescription& joint : world.joints) {
    if (absl::Status status = check_in(world, joint); !status.ok()) return status;
    if (absl::Status status = number_check(world, joint, joints_of); !status.ok()) return status;
    if (!names.insert(joint.name).second) {
      return refused(title(joint), ": the name must be unique, but two joints have it");
    }
    if (absl::Status status = leaders_check(world, joint); !status.ok()) return status;
  }
  return no_circle_check(world);
}

}  // namespace tessera
