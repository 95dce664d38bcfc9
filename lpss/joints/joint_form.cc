#include "lpss/joints/joint_form.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "lpss/base/portable_math.h"
#include "lpss/base/rotation.h"

namespace tessera {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

double wrapped(double angle) { return std::remainder(angle, 2 * std::numbers::pi); }

// The angle about x of a rotation, whatever its other components.
double turn_about_x(const Quaterniond& q) { return wrapped(2 * portable::atan2(q.x(), q.w())); }

// The child's joint frame in the parent's.
Pose between_frames(const JointForm& joint, const JointPlace& place) {
  const double q = place.position[0];
  const Vector3d x = Vector3d::UnitX();
  switch (joint.type) {
    case JointType::kFixed:
      return {};
    case JointType::kBall:
      return {Vector3d::Zero(), place.ball};
    case JointType::kRevolute:
      return {Vector3d::Zero(), rotation_by(q * x)};
    case JointType::kPrismatic:
      return {q * x, Quaterniond::Identity()};
    case JointType::kScrew:
      return {joint.pitch * q * x, rotation_by(q * x)};
    case JointType::kUniversal:
      return {Vector3d::Zero(), rotation_by(q * x) * rotation_by(place.position[1] * Vector3d::UnitY())};
  }
  return {};
}

}  // namespace

int axis_count(JointType type) {
  switch (type) {
    case JointType::kFixed:
    case JointType::kBall:
      return 0;
    case JointType::kRevolute:
    case JointType::kPrismatic:
    case JointType::kScrew:
      return 1;
    case JointType::kUniversal:
      return 2;
  }
  return 0;
}

std::array<double, 2> joint_position(JointType type, const Pose& parent_frame, const Pose& child_frame) {
  const Quaterniond& a = parent_frame.orientation;
  const Quaterniond& b = child_frame.orientation;
  switch (type) {
    case JointType::kFixed:
    case JointType::kBall:
      return {};
    case JointType::kRevolute:
    case JointType::kScrew:
      return {turn_about_x(a.conjugate() * b), 0};
    case JointType::kPrismatic:
      return {(a * Vector3d::UnitX()).dot(child_frame.position - parent_frame.position), 0};
    case JointType::kUniversal: {
      // The child's y stays at right angles to the parent's x.
      const Vector3d x = a * Vector3d::UnitX();
      const Vector3d child_x = b * Vector3d::UnitX();
      const Vector3d child_y = b * Vector3d::UnitY();
      return {portable::atan2((a * Vector3d::UnitZ()).dot(child_y), (a * Vector3d::UnitY()).dot(child_y)),
              portable::atan2(-x.cross(child_y).dot(child_x), x.dot(child_x))};
    }
  }
  return {};
}

JointState joint_state(const JointForm& joint, const JointSide& parent, const JointSide& child) {
  const Pose a = parent.pose * joint.in_parent;
  const Pose b = child.pose * joint.in_child;
  const Vector3d x = a.orientation * Vector3d::UnitX();
  const Vector3d apart = b.position - a.position;
  const Quaterniond turn = a.orientation.conjugate() * b.orientation;
  const Vector3d spin = child.angular_velocity - parent.angular_velocity;
  // The velocity of the child's frame as seen from the parent's.
  const Vector3d flow =
      child.linear_velocity + child.angular_velocity.cross(b.position - child.pose.position) -
      parent.linear_velocity - parent.angular_velocity.cross(b.position - parent.pose.position);

  JointState state;
  state.position = joint_position(joint.type, a, b);
  const Vector3d child_x = b.orientation * Vector3d::UnitX();
  const Vector3d child_y = b.orientation * Vector3d::UnitY();
  switch (joint.type) {
    case JointType::kFixed:
      state.gap = apart.norm();
      state.twist = rotation_angle(turn);
      break;
    case JointType::kBall:
      state.gap = apart.norm();
      break;
    case JointType::kRevolute:
      state.velocity[0] = x.dot(spin);
      state.gap = apart.norm();
      state.twist = portable::atan2(x.cross(child_x).norm(), x.dot(child_x));
      break;
    case JointType::kPrismatic:
      state.velocity[0] = x.dot(flow);
      state.gap = (apart - x * x.dot(apart)).norm();
      state.twist = rotation_angle(turn);
      break;
    case JointType::kScrew:
      state.velocity[0] = x.dot(spin);
      state.gap = (apart - x * x.dot(apart)).norm();
      state.twist = portable::atan2(x.cross(child_x).norm(), x.dot(child_x));
      break;
    case JointType::kUniversal:
      state.velocity[0] = x.dot(spin);
      state.velocity[1] = child_y.dot(spin);
      state.gap = apart.norm();
      state.twist = std::abs(portable::asin(std::clamp(x.dot(child_y), -1.0, 1.0)));
      break;
  }
  return state;
}

JointSide placed_child(const JointForm& joint, const JointSide& parent, const JointPlace& place) {
  const Pose a = parent.pose * joint.in_parent;
  const Pose b = a * between_frames(joint, place);
  const Vector3d x = a.orientation * Vector3d::UnitX();
  JointSide child;
  child.pose = b * joint.in_child.inverse();
  child.pose.orientation.normalize();
  child.angular_velocity = parent.angular_velocity;
  Vector3d flow = Vector3d::Zero();  // of the child's frame, as seen from the parent
  if (joint.type == JointType::kPrismatic) {
    flow = x * place.velocity[0];
  } else if (axis_count(joint.type) > 0) {
    child.angular_velocity += x * place.velocity[0];
  }
  if (joint.type == JointType::kScrew) flow = x * (joint.pitch * place.velocity[0]);
  if (joint.type == JointType::kUniversal)
    child.angular_velocity += b.orientation * Vector3d::UnitY() * place.velocity[1];
  child.linear_velocity = parent.linear_velocity +
                          parent.angular_velocity.cross(b.position - parent.pose.position) + flow -
                          child.angular_velocity.cross(b.position - child.pose.position);
  return child;
}

}  // namespace tessera
