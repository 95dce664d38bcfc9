#include "worlds/mjcf/actuators.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "lpss/model/limits.h"
#include "worlds/mjcf/joints.h"

namespace tessera::mjcf {
namespace {

// An effort of constant - stiffness * position - damping * velocity, at most `most`.
struct Affine {
  double constant = 0;
  double stiffness = 0;
  double damping = 0;
  double most = 0;
};

// The part of a joint's inertia that resists the axis, where the model stands at first.
double inertia_at(const mjModel& model, int joint) { return model.dof_M0[model.jnt_dofadr[joint]]; }

// Why an actuator is none of ours; empty if it is one.
std::string why_not(const mjModel& model, int n) {
  switch (model.actuator_trntype[n]) {
    case mjTRN_JOINT:
    case mjTRN_JOINTINPARENT:
      break;
    case mjTRN_TENDON:
      return "of a tendon";
    case mjTRN_BODY:
      return "of adhesion";
    case mjTRN_SITE:
      return "at a site";
    default:
      return "of a crank";
  }
  const int type = model.jnt_type[model.actuator_trnid[2 * n]];
  if (type != mjJNT_HINGE && type != mjJNT_SLIDE) return "of a ball or free joint";
  if (model.actuator_gaintype[n] != mjGAIN_FIXED ||
      (model.actuator_biastype[n] != mjBIAS_NONE && model.actuator_biastype[n] != mjBIAS_AFFINE))
    return "that is a muscle, or whose gain changes";
  return "";
}

double control_of(const mjModel& model, int n, const mjtNum* controls) {
  const double control = controls[n];
  if (model.actuator_ctrllimited[n] == 0 || (model.opt.disableflags & mjDSBL_CLAMPCTRL) != 0) return control;
  return std::clamp(control, model.actuator_ctrlrange[2 * n], model.actuator_ctrlrange[2 * n + 1]);
}

double largest_of(const mjtNum* range) { return std::max(std::abs(range[0]), std::abs(range[1])); }

// In efforts of the joint.
Affine affine_of(const mjModel& model, int n, const mjtNum* controls) {
  const double gear = model.actuator_gear[6 * n];
  const double gain = model.actuator_gainprm[mjNGAIN * n];
  const mjtNum* const bias = model.actuator_biasprm + mjNBIAS * n;
  const bool is_affine = model.actuator_biastype[n] == mjBIAS_AFFINE;
  // What integrates or filters its control begins with an activation of 0.
  const bool is_direct = model.actuator_dyntype[n] == mjDYN_NONE;
  Affine result;
  result.constant = gear * gain * (is_direct ? control_of(model, n, controls) : 0);
  if (is_affine) {
    result.constant += gear * bias[0];
    result.stiffness = -gear * gear * bias[1];
    result.damping = -gear * gear * bias[2];
    if (bias[2] > 0) {  // a ratio: Document::amend_servo()
      const double inertia = inertia_at(model, model.actuator_trnid[2 * n]);
      result.damping = 2 * bias[2] * std::sqrt(std::max(result.stiffness, 0.0) * inertia);
    }
  }
  result.most = kUnbounded;
  if (model.actuator_forcelimited[n] != 0) {
    result.most = std::abs(gear) * largest_of(model.actuator_forcerange + 2 * n);
  } else if (model.actuator_ctrllimited[n] != 0 && result.stiffness == 0 && result.damping == 0) {
    result.most = std::abs(gear * gain) * largest_of(model.actuator_ctrlrange + 2 * n);
  }
  return result;
}

// Drives aim at what a joint can reach; the rest of the effort is on top.
AxisDrive drive_of(const mjModel& model, int joint, const Affine& sum) {
  AxisDrive result;
  result.effort_max = sum.most;
  JointDrive& drive = result.drive;
  if (sum.stiffness == 0 && sum.damping == 0) {
    drive.mode = DriveMode::kEffort;
    drive.target = sum.constant;
    return result;
  }
  drive.mode = DriveMode::kServo;
  drive.stiffness = sum.stiffness;
  drive.damping = sum.damping;
  if (sum.stiffness > 0) {
    const double target = sum.constant / sum.stiffness - turns_of(model, joint);
    const double most = model.jnt_type[joint] == mjJNT_HINGE ? std::numbers::pi : kDriveWayMax;
    drive.target = std::clamp(target, -most, most);
    drive.effort = sum.stiffness * (target - drive.target);
  } else {
    const double most = model.jnt_type[joint] == mjJNT_HINGE ? kAngularSpeedMax : kSpeedMax;
    drive.velocity = std::clamp(sum.constant / sum.damping, -most, most);
  }
  return result;
}

std::string kind_of(const AxisDrive& drive) {
  if (drive.drive.mode == DriveMode::kEffort) return "drive of an effort";
  return drive.drive.stiffness > 0 ? "servo" : "servo of a velocity";
}

}  // namespace

std::map<int, AxisDrive> drives_of(const Model& model, const mjtNum* controls, Notices& notices) {
  std::map<int, Affine> sums;
  if ((model->opt.disableflags & mjDSBL_ACTUATION) != 0) return {};
  for (int n = 0; n < model->nu; ++n) {
    if (const std::string why = why_not(*model, n); !why.empty()) {
      notices.count(absl::StrCat("actuator ", why, ", not simulated"));
      continue;
    }
    const Affine one = affine_of(*model, n, controls);
    if (one.stiffness < 0 || one.damping < 0) {
      notices.count("actuator that pushes the farther away it is, or the faster, not simulated");
      continue;
    }
    if (model->actuator_dyntype[n] != mjDYN_NONE)
      notices.count("dynamics of an actuator, not simulated: it has what its control asks for at once");
    Affine& sum = sums[model->actuator_trnid[2 * n]];
    sum.constant += one.constant;
    sum.stiffness += one.stiffness;
    sum.damping += one.damping;
    sum.most += one.most;
  }
  std::map<int, AxisDrive> result;
  for (const auto& [joint, sum] : sums) {
    AxisDrive& drive = result[joint] = drive_of(*model, joint, sum);
    const auto bound = model.efforts.find(name_at(*model, model->name_jntadr, joint));
    if (bound != model.efforts.end()) drive.effort_max = std::min(drive.effort_max, bound->second);
    notices.count(absl::StrCat("actuated joint has a ", kind_of(drive)));
  }
  return result;
}

}  // namespace tessera::mjcf
