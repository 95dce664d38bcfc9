#include "lpss/programs/driven_joint.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tessera {
namespace {

constexpr double kPi = std::numbers::pi;

bool turns_freely(const SensedJoint& joint, std::size_t axis) {
  const JointProperties& form = joint.record.properties;
  return form.type != JointType::kPrismatic && form.axes[axis].lower < -kPi && form.axes[axis].upper > kPi;
}

}  // namespace

double way_to(const SensedJoint& joint, std::size_t axis, double place) {
  const double way = place - joint.state.position[axis];
  return turns_freely(joint, axis) ? std::remainder(way, 2 * kPi) : way;
}

double within_limits(const SensedJoint& joint, std::size_t axis, double place) {
  if (turns_freely(joint, axis)) return place;
  const JointProperties& form = joint.record.properties;
  const double most = form.type == JointType::kPrismatic ? kUnbounded : kPi;
  return std::clamp(place, std::max(form.axes[axis].lower, -most), std::min(form.axes[axis].upper, most));
}

JointDrive drive_to(const SensedJoint& joint, std::size_t axis, double place, double speed, double dt) {
  return {DriveMode::kVelocity, std::clamp(way_to(joint, axis, place) / dt, -speed, speed)};
}

JointDrive hold_at(const SensedJoint& joint, std::size_t axis, double place) {
  return {DriveMode::kPosition, turns_freely(joint, axis) ? std::remainder(place, 2 * kPi) : place};
}

void watch(const Senses& senses, const SensedJoint& joint, Actor& actor) {
  const JointProperties& properties = joint.record.properties;
  const bool is_held = properties.parent == senses.body || properties.child == senses.body;
  if (!is_held || senses.properties.motion == Motion::kKinematic) actor.wake_in(1);
}

}  // namespace tessera
