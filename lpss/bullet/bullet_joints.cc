#include "lpss/bullet/bullet_joints.h"

#include <algorithm>
#include <cmath>

#include "lpss/bullet/conversions.h"
#include "lpss/engine/shape_table.h"

namespace tessera::bullet {
namespace {

using Constraint = btGeneric6DofSpring2Constraint;

// The places of free motions in a constraint: along x, y, z, then about them.
constexpr int kAlongX = 0;
constexpr int kAboutX = 3;
constexpr int kAboutY = 4;

constexpr btScalar kNoLimit = 1e18;   // as Bullet's BT_LARGE_FLOAT: N, N m, m
constexpr btScalar kFastDrive = 1e6;  // m/s or rad/s: no motor gets there

btScalar bounded(double value) { return btScalar(std::clamp(value, -double(kNoLimit), double(kNoLimit))); }

void free(Constraint& constraint, int place) { constraint.setLimit(place, 1, -1); }

void set_limits(Constraint& constraint, int place, const JointAxis& axis) {
  if (std::isinf(axis.lower) && std::isinf(axis.upper)) return free(constraint, place);
  const bool is_angle = place >= kAboutX;
  const double most = is_angle ? double(SIMD_PI) : double(kNoLimit);
  constraint.setLimitReversed(place, btScalar(std::max(axis.lower, -most)),
                              btScalar(std::min(axis.upper, most)));
}

// Bullet's angles are those of the parent as the child sees it, and so are the velocities of all its motors.
btScalar position_for(int place, double position) {
  return btScalar(place >= kAboutX ? -position : position);
}

void set_motor(Constraint& constraint, int place, double velocity, double effort_max) {
  constraint.enableMotor(place, true);
  constraint.setTargetVelocity(place, bounded(-velocity));
  constraint.setMaxMotorForce(place, bounded(effort_max));
}

void set_spring(Constraint& constraint, int place, double stiffness, double damping, double reference) {
  if (stiffness == 0 && damping == 0) return;
  constraint.enableSpring(place, true);
  constraint.setStiffness(place, btScalar(stiffness));
  constraint.setDamping(place, btScalar(damping));
  constraint.setEquilibriumPoint(place, position_for(place, reference));
}

void set_drive(Constraint& constraint, int place, const JointAxis& axis, const JointDrive& drive) {
  switch (drive.mode) {
    case DriveMode::kFree:
      if (axis.friction > 0) set_motor(constraint, place, 0, axis.friction);
      return;
    case DriveMode::kVelocity:
      return set_motor(constraint, place, drive.target, axis.effort_max);
    case DriveMode::kPosition:
      set_motor(constraint, place, -std::min(axis.velocity_max, double(kFastDrive)), axis.effort_max);
      constraint.setServo(place, true);
      return constraint.setServoTarget(place, position_for(place, drive.target));
    case DriveMode::kEffort:
      return set_motor(constraint, place, std::copysign(double(kFastDrive), drive.target),
                       std::min(std::abs(drive.target), axis.effort_max));
    case DriveMode::kServo: {
      // Bullet's springs have no rate: where the spring rests is shifted by as much as it pushes.
      const double push = drive.damping * drive.velocity + drive.effort;
      const double shift = drive.stiffness > 0 ? push / drive.stiffness : 0;
      return set_spring(constraint, place, drive.stiffness, drive.damping + axis.damping,
                        drive.target + shift);
    }
  }
}

void set_axis(Constraint& constraint, int place, const JointRecord& joint, std::size_t n) {
  const JointAxis& axis = joint.properties.axes[n];
  set_limits(constraint, place, axis);
  set_spring(constraint, place, axis.spring_stiffness, axis.damping, axis.spring_reference);
  set_drive(constraint, place, axis, joint.drives[n]);
}

}  // namespace

std::unique_ptr<btGeneric6DofSpring2Constraint> make_joint(const JointRecord& joint, btRigidBody& parent,
                                                           const btTransform& in_parent, btRigidBody& child) {
  const JointProperties& properties = joint.properties;
  // The first axis of a universal joint is the parent's, the second the child's.
  const RotateOrder order = properties.type == JointType::kUniversal ? RO_YZX : RO_XYZ;
  auto made = std::make_unique<Constraint>(parent, child, in_parent, to_bullet(properties.in_child), order);
  for (int place = kAboutX; place < kAboutX + 3; ++place) made->setLimit(place, 0, 0);
  switch (properties.type) {
    case JointType::kFixed:
      break;
    case JointType::kRevolute:
      set_axis(*made, kAboutX, joint, 0);
      break;
    case JointType::kPrismatic:
      set_axis(*made, kAlongX, joint, 0);
      break;
    case JointType::kBall:
      for (int place = kAboutX; place < kAboutX + 3; ++place) free(*made, place);
      break;
    case JointType::kUniversal:
      set_axis(*made, kAboutX, joint, 0);
      set_axis(*made, kAboutY, joint, 1);
      break;
    case JointType::kScrew:
      require(false, "Bullet has no screw joints");
  }
  return made;
}

}  // namespace tessera::bullet
