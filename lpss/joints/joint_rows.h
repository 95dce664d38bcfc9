// The rows of a joint, which constrain the velocities of its two bodies, in double precision whatever the
// engine computes with.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lpss/model/joint.h"

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
  double compliance = 0;             // velocity per impulse: m/s per N s, or rad/s per N m s
  double impulse_min = -kUnbounded;  // N s or N m s
  double impulse_max = kUnbounded;
  bool is_held = false;  // a direction that is not free: unbounded impulse
  double error = 0;      // for held rows: m or rad, by which the bodies are off
};

// A joint at one time, relative to one origin near both of its bodies.
struct PosedJoint {
  JointSide parent;
  JointSide child;
  Pose in_parent;  // the joint frames in those of the bodies
  Pose in_child;

  Pose parent_frame() const { return parent.pose * in_parent; }
  Pose child_frame() const { return child.pose * in_child; }
};

// The pose of a body after `dt` seconds at its velocities.
JointSide moved(const JointSide& side, double dt);

// Appends the rows of one step of `dt` seconds, of which a tick has `steps`: first held rows, then damping,
// friction and drives, whose errors would add up, then limits.
void append_joint_rows(const JointProperties& joint, const JointDrives& drives, const PosedJoint& posed,
                       double dt, int steps, std::vector<JointRow>& rows);

// The first of them.
void append_held_rows(const JointProperties& joint, const PosedJoint& posed, double dt,
                      std::vector<JointRow>& rows);

}  // namespace tessera::joints
