// The rows of a joint, which constrain the velocities of its two bodies, in double precision whatever the
// engine computes with.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "lpss/joints/island_joint.h"
#include "lpss/joints/joint_form.h"

namespace tessera::joints {

// With the velocities v and angular velocities w of child (c) and parent (p) at the end of the step,
//
//   linear . (v_c - v_p) + angular_child . w_c - angular_parent . w_p + compliance * impulse = velocity
//
// as long as the impulse is within its bounds. World axes; units of a displacement, or of an angle (then also
// for members called linear).
struct JointRow {
  Eigen::Vector3d linear = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_child = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_parent = Eigen::Vector3d::Zero();
  double velocity = 0;               // m/s or rad/s
  double return_velocity = 0;        // on top, from beyond a limit: as far as kReturnSpeed allows
  double compliance = 0;             // velocity per impulse: m/s per N s, or rad/s per N m s
  double impulse_min = -kUnbounded;  // N s or N m s
  double impulse_max = kUnbounded;
  // Part of the sparse system: a direction that is not free, or, with a compliance, a spring or damper.
  // Unbounded impulse.
  bool is_held = false;
  double armature = 0;  // of a held row, which it slows along its axis: kg m^2 or kg
  double error = 0;     // for held rows without a compliance: m or rad, by which the bodies are off
  int axis = 0;         // of a row along an axis of the joint: which one
};

// The speed of an axis that returns from beyond a limit, which it keeps: rad/s or m/s. The more moves with
// the axis, the slower it returns: with the energy that its two bodies alone have at this speed, at most. A
// mechanism that jams before the limit is reached would otherwise take any effort.
inline constexpr double kReturnSpeed = 0.2;

// Of a joint.
inline constexpr int kHeldRowsMax = 6;

// A joint at one time, relative to one origin near both of its bodies.
struct PosedJoint {
  JointSide parent;
  JointSide child;
  Pose in_parent;  // the joint frames in those of the bodies
  Pose in_child;

  Pose parent_frame() const { return parent.pose * in_parent; }
  Pose child_frame() const { return child.pose * in_child; }
};

// `child` and `parent` are the sides of the joint, each relative to its sector; no parent if nothing moves
// it.
PosedJoint posed(const IslandJoint& joint, const JointSide& child, const std::optional<JointSide>& parent);

// The poses of its bodies, likewise.
struct JointPoses {
  Pose parent;
  Pose child;
};

// What moves a body; all 0 for one that nothing can push.
struct Inertia {
  double inverse_mass = 0;                                    // 1/kg
  Eigen::Matrix3d inverse_inertia = Eigen::Matrix3d::Zero();  // 1/(kg m^2), world axes
};

// One step of a joint.
struct JointStep {
  const JointForm& form;
  const JointDrives& drives;
  const PosedJoint& posed;
  Inertia parent;
  Inertia child;
  double dt = 0;  // s
  int steps = 1;  // of which a tick has so many
};

// The pose of a body after `dt` seconds at its velocities.
JointSide moved(const JointSide& side, double dt);

// Appends the rows of a step: first held rows, those of springs and dampers last of them; then friction and
// drives, whose errors would add up, then limits.
void append_joint_rows(const JointStep& step, std::vector<JointRow>& rows);

// The held rows without a compliance.
void append_held_rows(const JointForm& joint, const PosedJoint& posed, std::vector<JointRow>& rows);

// Writes the errors of these rows alone, at most six, with the bodies of `posed` in other poses.
void find_held_errors(const JointForm& joint, const PosedJoint& posed, const JointPoses& poses,
                      double* errors);

// The row of the rate of a coordinate of a joint that has it, without a velocity.
JointRow axis_row(JointType type, const PosedJoint& posed, int axis);

// The coordinate: rad (nearest to the middle of its limits, if it has any) or m.
double axis_position(const JointForm& joint, const PosedJoint& posed, int axis);

// Whether the coordinate is an angle that turns freely, and so known up to whole turns only.
bool turns_freely(const JointForm& joint, int axis);

}  // namespace tessera::joints
