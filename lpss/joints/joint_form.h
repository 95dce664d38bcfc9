// What a joint is, apart from which bodies it connects, and where in the world.
//
// It has a frame on each of its two bodies; at its zero, the two frames coincide. Its axes are those of the
// joint frame: the first is x, the second (universal) is y.
#pragma once

#include <Eigen/Core>
#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>

#include "lpss/base/pose.h"

namespace tessera {

// The id of a joint for its whole life; 0 is no joint.
struct JointId {
  std::uint64_t value = 0;

  friend auto operator<=>(const JointId&, const JointId&) = default;

  template <typename H>
  friend H AbslHashValue(H h, const JointId& id) {
    return H::combine(std::move(h), id.value);
  }
};

// The free motions:
enum class JointType : std::uint8_t {
  kFixed,      // nothing
  kRevolute,   // the angle about the axis
  kPrismatic,  // the displacement along the axis
  kBall,       // all angles
  kUniversal,  // the angles about the first axis (of the parent) and the second (of the child)
  kScrew,      // the angle about the axis, coupled with the displacement along it
};

inline constexpr double kUnbounded = std::numeric_limits<double>::infinity();

// Lets an axis follow an axis of another joint, the leader, as gears or a linkage do:
//
//   position = multiplier * (leader's position - reference) + offset
//
// What holds the follower back acts on the leader. An angle without limits is known up to whole turns only;
// what follows from it then is known up to as many turns, too. It ends with the leader's joint.
struct AxisMimic {
  JointId leader;         // another joint; 0: none. In a description: its place in the list plus one
  std::uint8_t axis = 0;  // of the leader: its place among the axes
  double multiplier = 1;  // within kMimicMultiplierMax
  double reference = 0;   // rad or m, of the leader
  double offset = 0;      // rad or m, of the follower

  bool is_set() const { return leader.value != 0; }
};

// One degree of freedom. Units: rad, N m and rad/s for an angle; m, N and m/s for a displacement.
struct JointAxis {
  double lower = -kUnbounded;  // for an angle: within [-pi, pi] if bounded; beyond that it is free
  double upper = kUnbounded;
  double velocity_max = kUnbounded;  // of the position drive; > 0
  double effort_max = kUnbounded;    // of every drive; >= 0
  double damping = 0;                // effort per velocity; >= 0
  double friction = 0;               // effort that resists any motion; >= 0
  double spring_stiffness = 0;       // effort per way from the reference, back to it; 0 to kGainMax
  double spring_reference = 0;       // rad or m; of an angle without limits: the nearest equivalent counts
  // kg m^2 or kg, 0 to kArmatureMax: a motor's rotor as the axis feels it through its gear (gear ratio^2
  // times its own). It adds to the inertia of what moves about the axis, and to nothing else.
  double armature = 0;
  AxisMimic mimic;
};

struct JointForm {
  JointType type = JointType::kFixed;
  Pose in_parent;                 // the joint frame in the centre frame of the parent
  Pose in_child;                  // the joint frame in the centre frame of the child
  std::array<JointAxis, 2> axes;  // as many as the type leaves free, ball joints excepted
  double pitch = 0;               // screw: metres along the axis per radian
};

enum class DriveMode : std::uint8_t {
  kFree,
  kVelocity,  // holds a velocity, with at most effort_max
  kPosition,  // moves to a position and holds it, with at most velocity_max and effort_max
  kEffort,    // applies an effort
  kServo,  // applies stiffness (target - position) + damping (velocity - rate) + effort, at most effort_max
};

// The drive of one axis of a joint; stays until it is changed. The gains of a servo may be of any size: they
// act on where and how fast the axis is at the end of a step.
struct JointDrive {
  DriveMode mode = DriveMode::kFree;
  double target = 0;  // rad/s or m/s; rad or m; N m or N

  // Of a servo:
  double stiffness = 0;  // N m/rad or N/m; 0 to kGainMax
  double damping = 0;    // N m s/rad or N s/m; 0 to kGainMax
  double velocity = 0;   // rad/s or m/s, of the target
  double effort = 0;     // N m or N, on top

  friend bool operator==(const JointDrive&, const JointDrive&) = default;
};

using JointDrives = std::array<JointDrive, 2>;

// Some of the axes of a joint: bit 0 is the first one.
using AxisMask = std::uint8_t;
inline constexpr AxisMask kBothAxes = 0b11;

// How many axes of the joint have a coordinate: 0 (fixed, ball), 1 or 2 (universal).
int axis_count(JointType type);

// These axes of a joint.
inline std::span<const JointAxis> axes_of(const JointForm& joint) {
  return {joint.axes.data(), static_cast<std::size_t>(axis_count(joint.type))};
}

// The pose and velocity of a body, in a frame common to two bodies.
struct JointSide {
  Pose pose;  // of the centre frame
  Eigen::Vector3d linear_velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();
};

// The coordinates of a joint: angles in (-pi, pi], displacements in m, their rates, and the separation of
// the two frames in the directions that are not free.
struct JointState {
  std::array<double, 2> position{};
  std::array<double, 2> velocity{};
  double gap = 0;    // m
  double twist = 0;  // rad
};

// The coordinates alone, from the joint frames of parent and child relative to one origin near both.
std::array<double, 2> joint_position(JointType type, const Pose& parent_frame, const Pose& child_frame);

// `parent` and `child` relative to one origin near both; the world as a parent is a side at `anchor` at rest.
JointState joint_state(const JointForm& joint, const JointSide& parent, const JointSide& child);

// The coordinates of a joint that a child is placed by.
struct JointPlace {
  std::array<double, 2> position{};                          // rad or m
  std::array<double, 2> velocity{};                          // rad/s or m/s
  Eigen::Quaterniond ball = Eigen::Quaterniond::Identity();  // of a ball joint: child's frame in the parent's
};

// The child of `parent` with these coordinates, relative to the same origin: the inverse of joint_state().
// The child of a ball joint has no spin relative to its parent.
JointSide placed_child(const JointForm& joint, const JointSide& parent, const JointPlace& place);

}  // namespace tessera
