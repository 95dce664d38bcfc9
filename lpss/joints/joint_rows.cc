#include "lpss/joints/joint_rows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "lpss/base/rotation.h"
#include "lpss/joints/soft_row.h"

namespace tessera::joints {
namespace {

using Eigen::Vector3d;

// The fraction of the distance to its target that a position drive moves in one tick.
constexpr double kServoGain = 0.2;

// A limit gets a row if the axis could reach it in the step at a speed increased by this: rad/s or m/s.
constexpr double kSpeedGained = 10;

// The fraction of the way beyond a limit that an axis returns by in a step.
constexpr double kReturned = 0.3;

constexpr double kPi = std::numbers::pi;

bool is_angle(JointType type) { return type != JointType::kPrismatic; }

bool is_limited(const JointAxis& axis) { return axis.lower > -kUnbounded || axis.upper < kUnbounded; }

// A coordinate for rows: an angle has no limits beyond half a turn, and takes the equivalent value nearest to
// the middle of its limits.
struct Coordinate {
  JointAxis axis;
  double position;
  bool turns_freely;

  // To a target: of an angle without limits, the shorter one.
  double way_to(double target) const {
    const double way = target - position;
    return turns_freely ? std::remainder(way, 2 * kPi) : way;
  }
};

Coordinate coordinate_of(JointType type, JointAxis axis, double position) {
  if (!is_angle(type)) return {axis, position, false};
  const double middle = (std::max(axis.lower, -kPi) + std::min(axis.upper, kPi)) / 2;
  if (axis.lower < -kPi) axis.lower = -kUnbounded;
  if (axis.upper > kPi) axis.upper = kUnbounded;
  if (!is_limited(axis)) return {axis, position, true};
  return {axis, middle + std::remainder(position - middle, 2 * kPi), false};
}

// The frames of a joint, with those vectors that rows are made of.
class Frames {
 public:
  // A ball joint does not look at axes.
  Frames(JointType type, const PosedJoint& posed)
      : Frames(type, posed, posed.parent.pose, posed.child.pose) {}

  // With the bodies in other poses.
  Frames(JointType type, const PosedJoint& posed, const Pose& parent, const Pose& child)
      : parent_point_(parent * posed.in_parent.position),
        child_point_(child * posed.in_child.position),
        child_lever_(child_point_ - child.position),
        parent_lever_(child_point_ - parent.position),
        apart_(child_point_ - parent_point_) {
    if (type == JointType::kBall) return;
    parent_turn_ = parent.orientation * posed.in_parent.orientation;
    child_turn_ = child.orientation * posed.in_child.orientation;
  }

  Pose parent() const { return {parent_point_, parent_turn_}; }
  Pose child() const { return {child_point_, child_turn_}; }
  const Eigen::Quaterniond& parent_turn() const { return parent_turn_; }
  const Eigen::Quaterniond& child_turn() const { return child_turn_; }
  const Vector3d& apart() const { return apart_; }  // m, from the parent's frame to the child's
  Vector3d x() const { return parent_turn_ * Vector3d::UnitX(); }

  // The joint's point on the child moves along `d`, as seen from the parent.
  JointRow along(const Vector3d& d) const {
    JointRow row;
    row.linear = d;
    row.angular_child = child_lever_.cross(d);
    row.angular_parent = parent_lever_.cross(d);
    return row;
  }

  // The same along an axis that turns with no body: each side has its own lever, also where the two points
  // are apart.
  JointRow along_own(const Vector3d& d) const {
    JointRow row = along(d);
    row.angular_parent = (parent_lever_ - apart_).cross(d);
    return row;
  }

  // The child turns about `n`, as seen from the parent.
  JointRow about(const Vector3d& n) const {
    JointRow row;
    row.angular_child = n;
    row.angular_parent = n;
    return row;
  }

 private:
  Vector3d parent_point_;  // of the joint
  Vector3d child_point_;
  Vector3d child_lever_;   // m, from the child's centre of mass to the joint's point on the child
  Vector3d parent_lever_;  // m, from the parent's centre of mass to the same point
  Vector3d apart_;
  Eigen::Quaterniond parent_turn_ = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond child_turn_ = Eigen::Quaterniond::Identity();
};

// The directions that a joint holds. `hold(row, error)` is called for each, with a function that makes the
// row: where only errors are wanted, none is made.
template <typename Hold>
class Directions {
 public:
  Directions(const Frames& frames, Hold hold) : frames_(frames), hold_(hold) {}

  void of(const JointForm& joint);

 private:
  void hold_point(const Vector3d& d) {
    hold_([&] { return frames_.along(d); }, d.dot(frames_.apart()));
  }
  void hold_angle(const Vector3d& n, double error) {
    hold_([&] { return frames_.about(n); }, error);
  }

  void hold_all_points() {
    for (int i = 0; i < 3; ++i)
      hold_([&] { return frames_.along_own(Vector3d::Unit(i)); }, frames_.apart()[i]);
  }

  // No rotation.
  void hold_all_angles(const Eigen::Matrix3d& axes) {
    const Eigen::Quaterniond turn = frames_.parent_turn().conjugate() * frames_.child_turn();
    const double sign = turn.w() < 0 ? -1 : 1;
    for (int i = 0; i < 3; ++i) hold_angle(axes.col(i), 2 * sign * turn.vec()[i]);
  }

  // Rotation only about the parent's x.
  void hold_axis(const Eigen::Matrix3d& axes) {
    const Vector3d tilt = axes.col(0).cross(frames_.child_turn() * Vector3d::UnitX());
    hold_angle(axes.col(1), axes.col(1).dot(tilt));
    hold_angle(axes.col(2), axes.col(2).dot(tilt));
  }

  // The child's y stays at right angles to the parent's x.
  void hold_right_angle(const Vector3d& x) {
    const Vector3d child_y = frames_.child_turn() * Vector3d::UnitY();
    hold_([&] { return frames_.about(x.cross(child_y).normalized()); }, -x.dot(child_y));
  }

  // The displacement along x follows the rotation about x. The displacement determines the number of whole
  // turns.
  void hold_thread(const Vector3d& x, double pitch) {
    const double angle = joint_position(JointType::kScrew, frames_.parent(), frames_.child())[0];
    double error = x.dot(frames_.apart()) - pitch * angle;
    if (pitch != 0) error = std::remainder(error, 2 * std::numbers::pi * pitch);
    const auto make = [&] {
      JointRow row = frames_.along(x);
      row.angular_child -= pitch * x;
      row.angular_parent -= pitch * x;
      return row;
    };
    hold_(make, error);
  }

  const Frames& frames_;
  Hold hold_;
};

template <typename Hold>
void Directions<Hold>::of(const JointForm& joint) {
  if (joint.type == JointType::kBall) return hold_all_points();
  const Eigen::Matrix3d axes = frames_.parent_turn().toRotationMatrix();
  switch (joint.type) {
    case JointType::kBall:
      break;
    case JointType::kFixed:
      hold_all_points();
      hold_all_angles(axes);
      break;
    case JointType::kRevolute:
      hold_all_points();
      hold_axis(axes);
      break;
    case JointType::kPrismatic:
      hold_point(axes.col(1));
      hold_point(axes.col(2));
      hold_all_angles(axes);
      break;
    case JointType::kScrew:
      hold_point(axes.col(1));
      hold_point(axes.col(2));
      hold_axis(axes);
      hold_thread(axes.col(0), joint.pitch);
      break;
    case JointType::kUniversal:
      hold_all_points();
      hold_right_angle(axes.col(0));
      break;
  }
}

// Makes the rows of one free axis of a joint.
class AxisRows {
 public:
  // `held` rows of the joint are the first of `rows`.
  AxisRows(const JointStep& step, const JointRow& motion, const Coordinate& at, std::size_t held,
           std::vector<JointRow>& rows)
      : step_(step), motion_(motion), at_(at), held_(held), rows_(rows) {}

  // Spring, damper and armature.
  void yield();
  void drive(const JointDrive& drive);
  void limit();

 private:
  void rub();
  void serve(const JointDrive& drive, JointRow row);
  void pull(double stiffness, double target, SoftEffort& effort);
  double mobility() const { return mobility_of(motion_, {rows_.data(), held_}, step_); }
  double rate() const;

  const JointStep& step_;
  const JointRow& motion_;
  const Coordinate& at_;
  const std::size_t held_;
  std::vector<JointRow>& rows_;
};

double AxisRows::rate() const {
  const PosedJoint& posed = step_.posed;
  return motion_.linear.dot(posed.child.linear_velocity - posed.parent.linear_velocity) +
         motion_.angular_child.dot(posed.child.angular_velocity) -
         motion_.angular_parent.dot(posed.parent.angular_velocity);
}

// By a spring, if it has any stiffness.
void AxisRows::pull(double stiffness, double target, SoftEffort& effort) {
  if (!(stiffness > 0)) return;
  effort.stiffness = stiffness;
  effort.way = at_.way_to(target);
  effort.rate = rate();
  effort.mobility = mobility();
  effort.mobility /= 1 + effort.mobility * at_.axis.armature;
}

void AxisRows::yield() {
  const JointAxis& axis = at_.axis;
  SoftEffort effort;
  effort.damping = axis.damping;
  pull(axis.spring_stiffness, axis.spring_reference, effort);
  JointRow row = motion_;
  row.is_held = true;
  row.armature = axis.armature;
  if (soften(effort, step_.dt, row)) return rows_.push_back(row);
  if (!(axis.armature > 0)) return;
  row.compliance = kUnbounded;
  rows_.push_back(row);
}

void AxisRows::rub() {
  if (!(at_.axis.friction > 0)) return;
  JointRow row = motion_;
  row.impulse_max = at_.axis.friction * step_.dt;
  row.impulse_min = -row.impulse_max;
  rows_.push_back(row);
}

void AxisRows::drive(const JointDrive& drive) {
  rub();
  const JointAxis& axis = at_.axis;
  JointRow row = motion_;
  row.impulse_max = axis.effort_max * step_.dt;
  row.impulse_min = -row.impulse_max;
  switch (drive.mode) {
    case DriveMode::kFree:
      return;
    case DriveMode::kVelocity:
      row.velocity = drive.target;
      break;
    case DriveMode::kPosition: {
      const double way = at_.way_to(std::clamp(drive.target, axis.lower, axis.upper));
      row.velocity =
          std::clamp(kServoGain * way / (step_.steps * step_.dt), -axis.velocity_max, axis.velocity_max);
      break;
    }
    case DriveMode::kEffort:
      row.impulse_min = row.impulse_max =
          std::clamp(drive.target * step_.dt, row.impulse_min, row.impulse_max);
      break;
    case DriveMode::kServo:
      serve(drive, row);
      return;
  }
  rows_.push_back(row);
}

void AxisRows::serve(const JointDrive& drive, JointRow row) {
  SoftEffort effort;
  effort.damping = drive.damping;
  effort.wanted_rate = drive.velocity;
  effort.effort = drive.effort;
  pull(drive.stiffness, drive.target, effort);
  if (!soften(effort, step_.dt, row)) {
    row.impulse_min = row.impulse_max = std::clamp(drive.effort * step_.dt, row.impulse_min, row.impulse_max);
  }
  rows_.push_back(row);
}

// An axis may reach a limit in one step, but not exceed it: no bounce.
void AxisRows::limit() {
  const double above = at_.position - at_.axis.lower;
  const double below = at_.axis.upper - at_.position;
  const double reach = (std::abs(rate()) + kSpeedGained) * step_.dt;
  const auto add = [this](double gap, double away, double impulse_min, double impulse_max) {
    JointRow row = motion_;
    (gap > 0 ? row.velocity : row.return_velocity) = away * (gap > 0 ? 1 : kReturned) * gap / step_.dt;
    row.impulse_min = impulse_min;
    row.impulse_max = impulse_max;
    rows_.push_back(row);
  };
  if (above < reach) add(above, -1, 0, kUnbounded);
  if (below < reach) add(below, 1, -kUnbounded, 0);
}

}  // namespace

JointSide moved(const JointSide& side, double dt) {
  JointSide end = side;
  end.pose.position += side.linear_velocity * dt;
  end.pose.orientation = (rotation_by(side.angular_velocity * dt) * side.pose.orientation).normalized();
  return end;
}

namespace {

void append_held_rows(const JointForm& joint, const Frames& frames, std::vector<JointRow>& rows) {
  const auto hold = [&rows](const auto& row, double error) {
    JointRow& held = rows.emplace_back(row());
    held.is_held = true;
    held.error = error;
  };
  Directions(frames, hold).of(joint);
}

JointRow axis_row(JointType type, const Frames& frames, int axis) {
  switch (type) {
    case JointType::kFixed:
    case JointType::kBall:
      break;
    case JointType::kRevolute:
    case JointType::kScrew:
      return frames.about(frames.x());
    case JointType::kPrismatic:
      return frames.along(frames.x());
    case JointType::kUniversal:
      return frames.about(axis == 0 ? frames.x() : frames.child_turn() * Vector3d::UnitY());
  }
  return {};
}

}  // namespace

void append_held_rows(const JointForm& joint, const PosedJoint& posed, std::vector<JointRow>& rows) {
  append_held_rows(joint, Frames(joint.type, posed), rows);
}

void find_held_errors(const JointForm& joint, const PosedJoint& posed, const JointPoses& poses,
                      double* errors) {
  if (joint.type == JointType::kBall) {  // without what it does not need
    Eigen::Map<Vector3d> apart(errors);
    apart = poses.child * posed.in_child.position - poses.parent * posed.in_parent.position;
    return;
  }
  const Frames frames(joint.type, posed, poses.parent, poses.child);
  const auto hold = [&errors](const auto&, double error) { *errors++ = error; };
  Directions(frames, hold).of(joint);
}

JointRow axis_row(JointType type, const PosedJoint& posed, int axis) {
  return axis_row(type, Frames(type, posed), axis);
}

PosedJoint posed(const IslandJoint& joint, const JointSide& child, const std::optional<JointSide>& parent) {
  PosedJoint posed;
  posed.child = child;
  posed.in_child = joint.form->in_child;
  if (parent) {
    posed.parent = *parent;
    posed.parent.pose.position += joint.parent_origin;
    posed.in_parent = joint.form->in_parent;
  } else {
    posed.parent = {joint.fixed_parent, joint.fixed_velocity, joint.fixed_spin};
  }
  return posed;
}

double axis_position(const JointForm& joint, const PosedJoint& posed, int axis) {
  const auto place = static_cast<std::size_t>(axis);
  const double position = joint_position(joint.type, posed.parent_frame(), posed.child_frame())[place];
  return coordinate_of(joint.type, joint.axes[place], position).position;
}

bool turns_freely(const JointForm& joint, int axis) {
  return coordinate_of(joint.type, joint.axes[static_cast<std::size_t>(axis)], 0).turns_freely;
}

void append_joint_rows(const JointStep& step, std::vector<JointRow>& rows) {
  const JointForm& joint = step.form;
  const Frames frames(joint.type, step.posed);
  append_held_rows(joint, frames, rows);
  const std::size_t held = rows.size();
  const int axes = axis_count(joint.type);
  if (axes == 0) return;
  const std::array<double, 2> position = joint_position(joint.type, frames.parent(), frames.child());
  std::array<JointRow, 2> motion;
  std::array<Coordinate, 2> at;
  for (std::size_t n = 0; n < static_cast<std::size_t>(axes); ++n) {
    motion[n] = axis_row(joint.type, frames, static_cast<int>(n));
    motion[n].axis = static_cast<int>(n);
    at[n] = coordinate_of(joint.type, joint.axes[n], position[n]);
  }
  const auto for_each_axis = [&](auto act) {
    for (std::size_t n = 0; n < static_cast<std::size_t>(axes); ++n) {
      act(AxisRows(step, motion[n], at[n], held, rows), step.drives[n]);
    }
  };
  for_each_axis([](AxisRows axis, const JointDrive&) { axis.yield(); });
  for_each_axis([](AxisRows axis, const JointDrive& drive) { axis.drive(drive); });
  for_each_axis([](AxisRows axis, const JointDrive&) { axis.limit(); });
}

}  // namespace tessera::joints
