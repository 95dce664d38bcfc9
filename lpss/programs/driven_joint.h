// Joints that a program senses and drives.
#pragma once

#include <cstddef>
#include <cstdint>

#include "lpss/programs/program.h"

namespace tessera {

// The largest id of a joint that a number holds.
inline constexpr double kJointNumberMax = static_cast<double>(kBodyIdMax);

inline JointId joint_id(double number) { return {static_cast<std::uint64_t>(number)}; }

// The joint that was asked for; null where it is gone, or 0.
inline const SensedJoint* driven_joint(const Senses& senses, std::uint32_t ask) {
  const std::span<const SensedJoint> found = senses.joints_of(ask);
  return found.empty() ? nullptr : &found.front();
}

// From where an axis is to `place` (rad or m): the shorter way of an angle that turns freely.
double way_to(const SensedJoint& joint, std::size_t axis, double place);

// The nearest place within the limits of an axis.
double within_limits(const SensedJoint& joint, std::size_t axis, double place);

// A drive that has the axis at `place` at the end of the next tick, as far as `speed` (rad/s or m/s) allows.
JointDrive drive_to(const SensedJoint& joint, std::size_t axis, double place, double speed, double dt);
// One that keeps it there.
JointDrive hold_at(const SensedJoint& joint, std::size_t axis, double place);

// Runs again in the next tick, where the body of the program may sleep while the joint moves: a kinematic
// one, or one that the joint does not hold.
void watch(const Senses& senses, const SensedJoint& joint, Actor& actor);

}  // namespace tessera
