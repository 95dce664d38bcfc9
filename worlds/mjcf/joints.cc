#include "worlds/mjcf/joints.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "lpss/base/rotation.h"
#include "lpss/model/limits.h"
#include "worlds/loader/joint_reader.h"

namespace tessera::mjcf {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using std::numbers::pi;

bool are_universal(const mjModel& model, int first, int second) {
  constexpr double kNear = 1e-9;
  constexpr double kRightAngle = 1e-6;
  if (model.jnt_type[first] != mjJNT_HINGE || model.jnt_type[second] != mjJNT_HINGE) return false;
  const Vector3d way = vector_at(model.jnt_pos + 3 * first) - vector_at(model.jnt_pos + 3 * second);
  const double cosine = vector_at(model.jnt_axis + 3 * first).dot(vector_at(model.jnt_axis + 3 * second));
  return way.norm() <= kNear && std::abs(cosine) <= kRightAngle;
}

bool has(const mjModel& model, mjtDisableBit bit) {
  return (model.opt.disableflags & (bit | mjDSBL_CONSTRAINT)) == 0;
}

// What a ball or free joint has in MuJoCo, and not here.
void note_lost(const mjModel& model, int joint, const char* type, Notices& notices) {
  const int freedom = model.jnt_dofadr[joint];
  const auto note = [&](bool is_there, const char* what) {
    if (is_there) notices.count(absl::StrCat("'", what, "' of a ", type, " joint, not simulated"));
  };
  note(model.jnt_limited[joint] != 0, "range");
  note(model.jnt_stiffness[joint] != 0, "stiffness");
  note(model.dof_damping[freedom] != 0, "damping");
  note(model.dof_frictionloss[freedom] != 0, "frictionloss");
  note(model.dof_armature[freedom] != 0, "armature");
}

JointAxis axis_of_joint(const mjModel& model, int joint, Notices& notices) {
  const int freedom = model.jnt_dofadr[joint];
  const bool is_angle = model.jnt_type[joint] == mjJNT_HINGE;
  const double turns = turns_of(model, joint);
  JointAxis axis;
  if (model.jnt_limited[joint] != 0 && has(model, mjDSBL_LIMIT)) {
    const double lower = model.jnt_range[2 * joint] - turns;
    const double upper = model.jnt_range[2 * joint + 1] - turns;
    if (is_angle) {
      set_angle_limits(lower, upper, axis, notices);
    } else {
      axis.lower = lower;
      axis.upper = upper;
    }
  }
  if ((model.opt.disableflags & mjDSBL_PASSIVE) == 0) {
    axis.damping = model.dof_damping[freedom];
    axis.spring_stiffness = model.jnt_stiffness[joint];
    axis.spring_reference = model.qpos_spring[model.jnt_qposadr[joint]] - turns;
  }
  if (has(model, mjDSBL_FRICTIONLOSS)) axis.friction = model.dof_frictionloss[freedom];
  axis.armature = model.dof_armature[freedom];
  return axis;
}

}  // namespace

std::vector<Hop> hops_of(const mjModel& model, int body) {
  std::vector<Hop> hops;
  const int end = model.body_jntadr[body] + model.body_jntnum[body];
  for (int joint = model.body_jntadr[body]; joint < end; ++joint) {
    if (model.jnt_type[joint] == mjJNT_BALL) {
      hops.push_back({JointType::kBall, {joint}});
    } else if (model.jnt_type[joint] == mjJNT_SLIDE) {
      hops.push_back({JointType::kPrismatic, {joint}});
    } else if (joint + 1 < end && are_universal(model, joint, joint + 1)) {
      hops.push_back({JointType::kUniversal, {joint, joint + 1}});
      ++joint;
    } else {
      hops.push_back({JointType::kRevolute, {joint}});
    }
  }
  return hops;
}

double turns_of(const mjModel& model, int joint) {
  if (model.jnt_type[joint] != mjJNT_HINGE || model.jnt_limited[joint] == 0) return 0;
  const double middle = (model.jnt_range[2 * joint] + model.jnt_range[2 * joint + 1]) / 2;
  return std::abs(middle) <= pi ? 0 : 2 * pi * std::round(middle / (2 * pi));
}

JointProperties joint_of(const mjModel& model, const Hop& hop, Notices& notices) {
  JointProperties result;
  result.type = hop.type;
  const int first = hop.joints.front();
  result.in_child.position = vector_at(model.jnt_pos + 3 * first);
  result.in_parent.position = result.in_child.position;
  if (hop.type == JointType::kBall) {
    note_lost(model, first, "ball", notices);
    notices.count_joint("ball");
    return result;
  }
  const auto zero = [&](int joint) { return model.qpos0[model.jnt_qposadr[joint]] - turns_of(model, joint); };
  const Vector3d x = vector_at(model.jnt_axis + 3 * first);
  Quaterniond axes = frame_along(x);
  if (hop.type == JointType::kUniversal) axes = frame_along(x, vector_at(model.jnt_axis + 3 * hop.joints[1]));
  result.in_parent.orientation = axes;
  result.in_child.orientation = axes;
  if (hop.type == JointType::kPrismatic) {
    result.in_parent.position -= zero(first) * x;
  } else {
    result.in_parent.orientation = (axes * rotation_by({-zero(first), 0, 0})).normalized();
  }
  if (hop.type == JointType::kUniversal)
    result.in_child.orientation = (axes * rotation_by({0, zero(hop.joints[1]), 0})).normalized();
  for (std::size_t n = 0; n < hop.joints.size(); ++n)
    result.axes[n] = axis_of_joint(model, hop.joints[n], notices);
  notices.count_joint(hop.type == JointType::kPrismatic ? "slide" : "hinge", hop.joints.size());
  return result;
}

JointPlace place_of(const mjModel& model, const Hop& hop, const mjtNum* positions, const mjtNum* velocities) {
  JointPlace place;
  if (hop.type == JointType::kBall) {
    place.ball = quaternion_at(positions + model.jnt_qposadr[hop.joints.front()]);
    return place;
  }
  for (std::size_t n = 0; n < hop.joints.size(); ++n) {
    const int joint = hop.joints[n];
    place.position[n] = positions[model.jnt_qposadr[joint]] - turns_of(model, joint);
    place.velocity[n] = velocities[model.jnt_dofadr[joint]];
  }
  return place;
}

absl::Status anchor(JointProperties& joint, double sector_size) {
  if (joint.parent != BodyId{}) return absl::OkStatus();
  const absl::StatusOr<WorldPose> pose = compose(WorldPose{}, joint.in_parent, sector_size);
  if (!pose.ok()) return pose.status();
  joint.anchor = pose->position.sector;
  joint.in_parent = {pose->position.local, pose->orientation};
  return absl::OkStatus();
}

}  // namespace tessera::mjcf
