// What a joint asks of the velocities of its two bodies: rows for a solver, in double precision whatever the
// engine computes with.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lpss/engine/joint.h"

namespace tessera::bullet {

// With the velocities v and angular velocities w of child (c) and parent (p) at the end of the step,
//
//   linear . (v_c - v_p) + angular_child . w_c - angular_parent . w_p + compliance * impulse = velocity
//
// as far as the impulse stays within its bounds. World axes; units of a way, or of an angle (then also where
// the words say linear).
struct JointRow {
  Eigen::Vector3d linear = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_child = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_parent = Eigen::Vector3d::Zero();
  double velocity = 0;    // m/s or rad/s
  double compliance = 0;  // velocity by which an impulse is given way to: m/s per N s, or rad/s per N m s
  double impulse_min = -kUnbounded;  // N s or N m s
  double impulse_max = kUnbounded;
  bool is_held = false;  // of what is not free: whatever it takes
};

// A joint at the start of a step, relative to one origin near both of its bodies.
struct PosedJoint {
  JointSide parent;
  JointSide child;
  Pose parent_frame;  // of the joint
  Pose child_frame;
};

// Appends the rows of one step of `dt` seconds: first what is not free, whose errors are seen and taken back
// in the next step, then damping, friction and drives, whose errors would add up, then limits.
void append_joint_rows(const JointProperties& joint, const JointDrives& drives, const PosedJoint& posed,
                       double dt, std::vector<JointRow>& rows);

}  // namespace tessera::bullet
