#include "lpss/joints/joint_rows.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "lpss/base/rotation.h"

namespace tessera::joints {
namespace {

using Eigen::Vector3d;

// The fraction of the distance to its target that a position drive moves in one tick.
constexpr double kServoGain = 0.2;

// A limit gets a row if the axis could reach it in the step at a speed increased by this: rad/s or m/s.
constexpr double kSpeedGained = 10;

// The fraction of the way beyond a limit that an axis returns by in a step.
constexpr double kReturned = 0.3;

// The maximum speed of an axis returning from beyond a limit, which it keeps. rad/s or m/s.
constexpr double kReturnSpeed = 0.2;

bool is_limited(const JointAxis& axis) { return axis.lower > -kUnbounded || axis.upper < kUnbounded; }

// A coordinate for rows: an angle has no limits beyond half a turn, and takes the equivalent value nearest to
// the middle of its limits.
struct Coordinate {
  JointAxis axis;
  double position;
};

Coordinate way_of(const JointAxis& axis, double position) { return {axis, position}; }

Coordinate angle_of(JointAxis axis, double angle) {
  constexpr double kPi = std::numbers::pi;
  const double middle = (std::max(axis.lower, -kPi) + std::min(axis.upper, kPi)) / 2;
  if (axis.lower < -kPi) axis.lower = -kUnbounded;
  if (axis.upper > kPi) axis.upper = kUnbounded;
  return {axis, is_limited(axis) ? middle + std::remainder(angle - middle, 2 * kPi) : angle};
}

// Makes the rows of one joint.
class RowMaker {
 public:
  RowMaker(const PosedJoint& posed, double dt, int steps, std::vector<JointRow>& rows)
      : posed_(posed),
        dt_(dt),
        steps_(steps),
        rows_(rows),
        parent_frame_(posed.parent_frame()),
        child_frame_(posed.child_frame()),
        child_lever_(child_frame_.position - posed.child.pose.position),
        parent_lever_(child_frame_.position - posed.parent.pose.position),
        apart_(child_frame_.position - parent_frame_.position) {}

  // The joint's point on the child moves along `d`, as seen from the parent.
  JointRow along(const Vector3d& d) const {
    JointRow row;
    row.linear = d;
    row.angular_child = child_lever_.cross(d);
    row.angular_parent = parent_lever_.cross(d);
    return row;
  }

  // The child turns about `n`, as seen from the parent.
  JointRow about(const Vector3d& n) const {
    JointRow row;
    row.angular_child = n;
    row.angular_parent = n;
    return row;
  }

  void hold_point(const Vector3d& d) { hold(along(d), d.dot(apart_)); }
  void hold_angle(const Vector3d& n, double error) { hold(about(n), error); }

  // The axes turn with no body, unlike those of hold_point(): each side has its own lever, also where the two
  // points are apart.
  void hold_all_points() {
    for (int i = 0; i < 3; ++i) {
      JointRow row = along(Vector3d::Unit(i));
      row.angular_parent = (parent_lever_ - apart_).cross(row.linear);
      hold(row, apart_[i]);
    }
  }

  // No rotation.
  void hold_all_angles(const Eigen::Matrix3d& axes) {
    const Eigen::Quaterniond turn = parent_frame_.orientation.conjugate() * child_frame_.orientation;
    const double sign = turn.w() < 0 ? -1 : 1;
    for (int i = 0; i < 3; ++i) hold_angle(axes.col(i), 2 * sign * turn.vec()[i]);
  }

  // Rotation only about the parent's x.
  void hold_axis(const Eigen::Matrix3d& axes) {
    const Vector3d tilt = axes.col(0).cross(child_frame_.orientation * Vector3d::UnitX());
    hold_angle(axes.col(1), axes.col(1).dot(tilt));
    hold_angle(axes.col(2), axes.col(2).dot(tilt));
  }

  // The child's y stays at right angles to the parent's x.
  void hold_right_angle(const Vector3d& x, const Vector3d& child_y) {
    const Vector3d n = x.cross(child_y).normalized();
    hold(about(n), -x.dot(child_y));
  }

  // The displacement along x follows the rotation about x. The displacement determines the number of whole
  // turns.
  void hold_thread(const Vector3d& x, double angle, double pitch) {
    JointRow row = along(x);
    row.angular_child -= pitch * x;
    row.angular_parent -= pitch * x;
    double error = x.dot(apart_) - pitch * angle;
    if (pitch != 0) error = std::remainder(error, 2 * std::numbers::pi * pitch);
    hold(row, error);
  }

  void drive(const JointRow& motion, const Coordinate& at, const JointDrive& drive, bool is_angle);
  void limit(const JointRow& motion, const Coordinate& at);

 private:
  void hold(JointRow row, double error) {
    row.is_held = true;
    row.error = error;
    rows_.push_back(row);
  }

  void resist(JointRow row, const JointAxis& axis);

  double rate(const JointRow& motion) const {
    return motion.linear.dot(posed_.child.linear_velocity - posed_.parent.linear_velocity) +
           motion.angular_child.dot(posed_.child.angular_velocity) -
           motion.angular_parent.dot(posed_.parent.angular_velocity);
  }

  const PosedJoint& posed_;
  const double dt_;
  const int steps_;  // of a tick
  std::vector<JointRow>& rows_;
  const Pose parent_frame_;  // of the joint
  const Pose child_frame_;
  const Vector3d child_lever_;   // m, from the child's centre of mass to the joint's point on the child
  const Vector3d parent_lever_;  // m, from the parent's centre of mass to the same point
  const Vector3d apart_;         // m, from the parent's frame to the child's
};

// Damping and friction.
void RowMaker::resist(JointRow row, const JointAxis& axis) {
  row.velocity = 0;
  // Smaller values have no inverse, and no effect.
  if (axis.damping * dt_ >= std::numeric_limits<double>::min()) {
    row.compliance = 1 / (axis.damping * dt_);
    rows_.push_back(row);
    row.compliance = 0;
  }
  if (axis.friction > 0) {
    row.impulse_max = axis.friction * dt_;
    row.impulse_min = -row.impulse_max;
    rows_.push_back(row);
  }
}

void RowMaker::drive(const JointRow& motion, const Coordinate& at, const JointDrive& drive, bool is_angle) {
  const JointAxis& axis = at.axis;
  resist(motion, axis);
  JointRow row = motion;
  row.impulse_max = axis.effort_max * dt_;
  row.impulse_min = -row.impulse_max;
  switch (drive.mode) {
    case DriveMode::kFree:
      return;
    case DriveMode::kVelocity:
      row.velocity = drive.target;
      break;
    case DriveMode::kPosition: {
      double way = std::clamp(drive.target, axis.lower, axis.upper) - at.position;
      if (is_angle && !is_limited(axis)) way = std::remainder(way, 2 * std::numbers::pi);
      row.velocity = std::clamp(kServoGain * way / (steps_ * dt_), -axis.velocity_max, axis.velocity_max);
      break;
    }
    case DriveMode::kEffort:
      row.impulse_min = row.impulse_max = std::clamp(drive.target * dt_, row.impulse_min, row.impulse_max);
      break;
  }
  rows_.push_back(row);
}

// An axis may reach a limit in one step, but not exceed it: no bounce.
void RowMaker::limit(const JointRow& motion, const Coordinate& at) {
  const double above = at.position - at.axis.lower;
  const double below = at.axis.upper - at.position;
  const double reach = (std::abs(rate(motion)) + kSpeedGained) * dt_;
  const auto wanted = [this](double gap) {
    return gap > 0 ? gap / dt_ : std::max(kReturned * gap / dt_, -kReturnSpeed);
  };
  if (above < reach) {
    JointRow row = motion;
    row.velocity = -wanted(above);
    row.impulse_min = 0;
    rows_.push_back(row);
  }
  if (below < reach) {
    JointRow row = motion;
    row.velocity = wanted(below);
    row.impulse_max = 0;
    rows_.push_back(row);
  }
}

}  // namespace

JointSide moved(const JointSide& side, double dt) {
  JointSide end = side;
  end.pose.position += side.linear_velocity * dt;
  end.pose.orientation = (rotation_by(side.angular_velocity * dt) * side.pose.orientation).normalized();
  return end;
}

void append_held_rows(const JointProperties& joint, const PosedJoint& posed, double dt,
                      std::vector<JointRow>& rows) {
  RowMaker make(posed, dt, /*steps=*/1, rows);
  const Eigen::Matrix3d axes = posed.parent_frame().orientation.toRotationMatrix();
  const Vector3d x = axes.col(0);
  switch (joint.type) {
    case JointType::kFixed:
      make.hold_all_points();
      make.hold_all_angles(axes);
      break;
    case JointType::kBall:
      make.hold_all_points();
      break;
    case JointType::kRevolute:
      make.hold_all_points();
      make.hold_axis(axes);
      break;
    case JointType::kPrismatic:
      make.hold_point(axes.col(1));
      make.hold_point(axes.col(2));
      make.hold_all_angles(axes);
      break;
    case JointType::kScrew:
      make.hold_point(axes.col(1));
      make.hold_point(axes.col(2));
      make.hold_axis(axes);
      make.hold_thread(x, joint_position(joint.type, posed.parent_frame(), posed.child_frame())[0],
                       joint.pitch);
      break;
    case JointType::kUniversal:
      make.hold_all_points();
      make.hold_right_angle(x, posed.child_frame().orientation * Vector3d::UnitY());
      break;
  }
}

void append_joint_rows(const JointProperties& joint, const JointDrives& drives, const PosedJoint& posed,
                       double dt, int steps, std::vector<JointRow>& rows) {
  append_held_rows(joint, posed, dt, rows);
  RowMaker make(posed, dt, steps, rows);
  const Pose parent_frame = posed.parent_frame();
  const Pose child_frame = posed.child_frame();
  const Vector3d x = parent_frame.orientation * Vector3d::UnitX();
  const std::array<double, 2> position = joint_position(joint.type, parent_frame, child_frame);
  switch (joint.type) {
    case JointType::kFixed:
    case JointType::kBall:
      break;
    case JointType::kRevolute:
    case JointType::kScrew: {
      const Coordinate angle = angle_of(joint.axes[0], position[0]);
      make.drive(make.about(x), angle, drives[0], /*is_angle=*/true);
      make.limit(make.about(x), angle);
      break;
    }
    case JointType::kPrismatic: {
      const Coordinate way = way_of(joint.axes[0], position[0]);
      make.drive(make.along(x), way, drives[0], /*is_angle=*/false);
      make.limit(make.along(x), way);
      break;
    }
    case JointType::kUniversal: {
      const Vector3d child_y = child_frame.orientation * Vector3d::UnitY();
      const Coordinate first = angle_of(joint.axes[0], position[0]);
      const Coordinate second = angle_of(joint.axes[1], position[1]);
      make.drive(make.about(x), first, drives[0], /*is_angle=*/true);
      make.drive(make.about(child_y), second, drives[1], /*is_angle=*/true);
      make.limit(make.about(x), first);
      make.limit(make.about(child_y), second);
      break;
    }
  }
}

}  // namespace tessera::joints
