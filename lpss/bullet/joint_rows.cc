#include "lpss/bullet/joint_rows.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace tessera::bullet {
namespace {

using Eigen::Vector3d;

// The share of an error that one step takes back.
constexpr double kErrorReduction = 0.3;

// The share of the turning within a step that rows foresee. Without, a swinging link is 7 mm off its hinge
// and loses its energy within a minute; with all of it, rounding and lag would add energy, and a spinning one
// run away.
constexpr double kForesight = 0.8;

// The share of the way to its target that a position drive wants to go in one step.
constexpr double kServoGain = 0.2;

// A limit is looked at when an axis could be there after the step, were it faster by this: rad/s or m/s.
constexpr double kSpeedGained = 10;

// How fast an axis comes back from beyond a limit, at most: it keeps that speed. rad/s or m/s.
constexpr double kReturnSpeed = 0.2;

// Bullet turns a body by no more than this in one step, rad.
constexpr double kTurnMax = std::numbers::pi / 4;

Vector3d turning(const Vector3d& angular_velocity, double dt) {
  const double turn = angular_velocity.norm() * dt;
  return turn > kTurnMax ? Vector3d(angular_velocity * (kTurnMax / turn)) : angular_velocity;
}

bool is_limited(const JointAxis& axis) { return axis.lower > -kUnbounded || axis.upper < kUnbounded; }

// A coordinate as rows see it: an angle has no limits beyond half a turn, and is the one of its values that
// is nearest to the middle of what its limits leave.
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

// Makes the rows of one joint. What is held is held at the *end* of the step: poses turn while they move, so
// the rows foresee, to second order in dt, how an error would grow by that at the present velocities
// ("curve").
class RowMaker {
 public:
  RowMaker(const PosedJoint& posed, double dt, std::vector<JointRow>& rows)
      : posed_(posed),
        dt_(dt),
        rows_(rows),
        child_lever_(posed.child_frame.position - posed.child.pose.position),
        parent_lever_(posed.child_frame.position - posed.parent.pose.position),
        apart_(posed.child_frame.position - posed.parent_frame.position) {
    const Vector3d child_turn = turning(posed.child.angular_velocity, dt);
    const Vector3d parent_turn = turning(posed.parent.angular_velocity, dt);
    const Vector3d flow = posed.child.linear_velocity + child_turn.cross(child_lever_) -
                          posed.parent.linear_velocity - parent_turn.cross(parent_lever_);
    spin_ = child_turn - parent_turn;
    point_curve_ = child_turn.cross(child_turn.cross(child_lever_)) -
                   parent_turn.cross(parent_turn.cross(parent_lever_)) - 2 * parent_turn.cross(flow);
    turn_curve_ = child_turn.cross(parent_turn);
  }

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

  void hold_point(const Vector3d& d) { hold(along(d), d.dot(apart_), d.dot(point_curve_)); }
  void hold_angle(const Vector3d& n, double error) { hold(about(n), error, n.dot(turn_curve_)); }

  void hold_all_points(const Eigen::Matrix3d& axes) {
    for (int i = 0; i < 3; ++i) hold_point(axes.col(i));
  }

  // No turn at all.
  void hold_all_angles(const Eigen::Matrix3d& axes) {
    const Eigen::Quaterniond turn =
        posed_.parent_frame.orientation.conjugate() * posed_.child_frame.orientation;
    const double sign = turn.w() < 0 ? -1 : 1;
    for (int i = 0; i < 3; ++i) hold_angle(axes.col(i), 2 * sign * turn.vec()[i]);
  }

  // No turn but about the parent's x.
  void hold_axis(const Eigen::Matrix3d& axes) {
    const Vector3d tilt = axes.col(0).cross(posed_.child_frame.orientation * Vector3d::UnitX());
    hold_angle(axes.col(1), axes.col(1).dot(tilt));
    hold_angle(axes.col(2), axes.col(2).dot(tilt));
  }

  // The child's y stays at right angles to the parent's x.
  void hold_right_angle(const Vector3d& x, const Vector3d& child_y) {
    const Vector3d n = x.cross(child_y).normalized();
    hold(about(n), -x.dot(child_y), n.dot(turn_curve_) - x.dot(spin_) * child_y.dot(spin_));
  }

  // So far along x as it is turned about x. How many whole turns there were is seen by the way.
  void hold_thread(const Vector3d& x, double angle, double pitch) {
    JointRow row = along(x);
    row.angular_child -= pitch * x;
    row.angular_parent -= pitch * x;
    double error = x.dot(apart_) - pitch * angle;
    if (pitch != 0) error = std::remainder(error, 2 * std::numbers::pi * pitch);
    hold(row, error, x.dot(point_curve_) - pitch * x.dot(turn_curve_));
  }

  void drive(const JointRow& motion, const Coordinate& at, const JointDrive& drive, bool is_angle);
  void limit(const JointRow& motion, const Coordinate& at);

 private:
  void hold(JointRow row, double error, double curve) {
    row.is_held = true;
    row.velocity = -kErrorReduction * error / dt_ - kForesight * curve * dt_ / 2;
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
  std::vector<JointRow>& rows_;
  const Vector3d child_lever_;   // m, from the child's centre of mass to the joint's point on the child
  const Vector3d parent_lever_;  // m, from the parent's centre of mass to the same point
  const Vector3d apart_;         // m, from the parent's frame to the child's
  Vector3d spin_;                // rad/s, of the child as seen from the parent
  Vector3d point_curve_;         // m/s^2
  Vector3d turn_curve_;          // rad/s^2
};

// Damping and friction.
void RowMaker::resist(JointRow row, const JointAxis& axis) {
  row.velocity = 0;
  // Less has no inverse, and no effect.
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
      row.velocity = std::clamp(kServoGain * way / dt_, -axis.velocity_max, axis.velocity_max);
      break;
    }
    case DriveMode::kEffort:
      row.impulse_min = row.impulse_max = std::clamp(drive.target * dt_, row.impulse_min, row.impulse_max);
      break;
  }
  rows_.push_back(row);
}

// An axis may come as far as a limit in one step, and no farther: no bounce.
void RowMaker::limit(const JointRow& motion, const Coordinate& at) {
  const double above = at.position - at.axis.lower;
  const double below = at.axis.upper - at.position;
  const double reach = (std::abs(rate(motion)) + kSpeedGained) * dt_;
  const auto wanted = [this](double gap) {
    return gap > 0 ? gap / dt_ : std::max(kErrorReduction * gap / dt_, -kReturnSpeed);
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

void append_joint_rows(const JointProperties& joint, const JointDrives& drives, const PosedJoint& posed,
                       double dt, std::vector<JointRow>& rows) {
  RowMaker make(posed, dt, rows);
  const Eigen::Matrix3d axes = posed.parent_frame.orientation.toRotationMatrix();
  const Vector3d x = axes.col(0);
  const std::array<double, 2> position = joint_position(joint.type, posed.parent_frame, posed.child_frame);
  switch (joint.type) {
    case JointType::kFixed:
      make.hold_all_points(axes);
      make.hold_all_angles(axes);
      break;
    case JointType::kBall:
      make.hold_all_points(axes);
      break;
    case JointType::kRevolute: {
      const Coordinate angle = angle_of(joint.axes[0], position[0]);
      make.hold_all_points(axes);
      make.hold_axis(axes);
      make.drive(make.about(x), angle, drives[0], /*is_angle=*/true);
      make.limit(make.about(x), angle);
      break;
    }
    case JointType::kPrismatic: {
      const Coordinate way = way_of(joint.axes[0], position[0]);
      make.hold_point(axes.col(1));
      make.hold_point(axes.col(2));
      make.hold_all_angles(axes);
      make.drive(make.along(x), way, drives[0], /*is_angle=*/false);
      make.limit(make.along(x), way);
      break;
    }
    case JointType::kScrew: {
      const Coordinate angle = angle_of(joint.axes[0], position[0]);
      make.hold_point(axes.col(1));
      make.hold_point(axes.col(2));
      make.hold_axis(axes);
      make.hold_thread(x, position[0], joint.pitch);
      make.drive(make.about(x), angle, drives[0], /*is_angle=*/true);
      make.limit(make.about(x), angle);
      break;
    }
    case JointType::kUniversal: {
      const Vector3d child_y = posed.child_frame.orientation * Vector3d::UnitY();
      const Coordinate first = angle_of(joint.axes[0], position[0]);
      const Coordinate second = angle_of(joint.axes[1], position[1]);
      make.hold_all_points(axes);
      make.hold_right_angle(x, child_y);
      make.drive(make.about(x), first, drives[0], /*is_angle=*/true);
      make.drive(make.about(child_y), second, drives[1], /*is_angle=*/true);
      make.limit(make.about(x), first);
      make.limit(make.about(child_y), second);
      break;
    }
  }
}

}  // namespace tessera::bullet
