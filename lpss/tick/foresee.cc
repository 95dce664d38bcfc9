#include "lpss/tick/foresee.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "lpss/base/invariant.h"

namespace tessera {
namespace {

// The share of the way to its target that a position drive goes in a tick (lpss/joints/joint_rows.cc).
constexpr double kServoGain = 0.2;

// rad: of a screw without limits, and of any angle.
constexpr double kHalfTurn = std::numbers::pi;

// How a child moves along an axis of its joint, were its parent to stand.
struct AxisMotion {
  double mobility = 0;  // m/s or rad/s by N s or N m s
  double arm = 1;       // m, that a point of the child moves by a unit of the coordinate, at most
};

AxisMotion motion_of(const JointProperties& joint, int axis, const HomeBody& child) {
  const double mass = child.properties.mass;
  if (joint.type == JointType::kPrismatic) return {1 / mass, 1};
  const Eigen::Vector3d moments(child.properties.inertia.data());
  const Eigen::Vector3d lever = joint.in_child.position;
  if (joint.type == JointType::kUniversal && axis == 0)  // its axis is that of the parent
    return {1 / moments.minCoeff(), child.radius + lever.norm()};
  const Eigen::Vector3d about =
      joint.in_child.orientation * (axis == 0 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY());
  const double away = about.cross(lever).norm();
  const double pitch = joint.type == JointType::kScrew ? joint.pitch : 0;
  const double inertia = about.dot(moments.cwiseProduct(about)) + mass * (away * away + pitch * pitch);
  return {1 / inertia, child.radius + away + std::abs(pitch)};
}

// An axis at the start of a tick, as far as it is known.
struct AxisState {
  bool is_known = false;
  double position = 0;  // rad or m
  double rate = 0;      // of one that is not known, how fast the child moves
};

class AxisSurge {
 public:
  AxisSurge(const JointAxis& axis, bool is_angle, const AxisState& state, const AxisMotion& motion, double dt)
      : axis_(axis), is_angle_(is_angle), state_(state), motion_(motion), dt_(dt) {}

  // m or rad, that the axis may go farther in the tick by its drive.
  double of(const JointDrive& drive) const {
    switch (drive.mode) {
      case DriveMode::kFree:
        return 0;
      case DriveMode::kVelocity:
        return bounded(axis_.effort_max, change_to(drive.target));
      case DriveMode::kPosition: {
        const double way = way_to(std::clamp(drive.target, axis_.lower, axis_.upper));
        const double wanted = std::clamp(kServoGain * way / dt_, -axis_.velocity_max, axis_.velocity_max);
        return bounded(axis_.effort_max, change_to(wanted));
      }
      case DriveMode::kEffort:
        return bounded(std::min(std::abs(drive.target), axis_.effort_max), kUnbounded);
      case DriveMode::kServo:
        return of_servo(drive);
    }
    return 0;
  }

  double of_spring() const {
    const double way = std::abs(way_to(axis_.spring_reference));
    return axis_.spring_stiffness > 0 ? bounded(axis_.spring_stiffness * way, 2 * way) : 0;
  }

 private:
  double of_servo(const JointDrive& drive) const {
    const double way = drive.stiffness > 0 ? std::abs(way_to(drive.target)) : 0;
    const double rates =
        drive.damping > 0 || drive.stiffness > 0 ? std::abs(drive.velocity) + std::abs(state_.rate) : 0;
    const double effort = drive.stiffness * way + drive.damping * rates + std::abs(drive.effort);
    const double on_top = bounded(std::min(std::abs(drive.effort), axis_.effort_max), kUnbounded);
    return bounded(std::min(effort, axis_.effort_max), way + rates * dt_ + on_top);
  }

  // By an effort that acts all the tick, and no farther than `most`.
  double bounded(double effort, double most) const {
    return std::min(effort * motion_.mobility * dt_ * dt_, most);
  }

  double change_to(double rate) const {
    return (state_.is_known ? std::abs(rate - state_.rate) : std::abs(rate) + state_.rate) * dt_;
  }

  // Of an axis that is not known, the longest.
  double way_to(double target) const {
    const bool is_limited = axis_.lower > -kUnbounded && axis_.upper < kUnbounded;
    if (state_.is_known) {
      const double way = target - state_.position;
      return is_angle_ && !is_limited ? std::remainder(way, 2 * kHalfTurn) : way;
    }
    if (is_limited) return axis_.upper - axis_.lower;
    return is_angle_ ? kHalfTurn : std::numeric_limits<double>::max();
  }

  const JointAxis& axis_;
  const bool is_angle_;
  const AxisState& state_;
  const AxisMotion& motion_;
  const double dt_;
};

// A parent, seen from the child's sector.
struct Parent {
  bool stands = false;
  // Of one that stands, or lives in the same sector: what is known of others depends on who hosts them.
  std::optional<JointSide> side;
};

Parent parent_of(const Partition& partition, const JointRecord& joint, const HomeBody& child) {
  const SectorIndex& seen_from = child.sector->index;
  if (joint.parent_motion == Motion::kDynamic) {
    const auto parent = partition.bodies.find(joint.properties.parent);
    if (parent == partition.bodies.end() || parent->second->sector != child.sector) return {};
    return {false, side_of(child.sector->world->state(parent->second->slot))};
  }
  if (joint.parent_motion != Motion::kStatic) return {};
  SectorIndex home = joint.properties.anchor;
  JointSide side;
  if (joint.properties.parent.value != 0) {
    const BodyRecord* const parent = partition.statics.find(joint.properties.parent);
    invariant(parent != nullptr, "the static parent of a joint is there as long as the joint");
    home = parent->home;
    side = side_of(parent->state);
  }
  side.pose.position += metres_between(seen_from, home, partition.sector_size());
  return {true, side};
}

bool has_effort(const JointRecord& joint) {
  for (int axis = 0; axis < axis_count(joint.properties.type); ++axis) {
    const auto n = static_cast<std::size_t>(axis);
    if (joint.drives[n].mode != DriveMode::kFree || joint.properties.axes[n].spring_stiffness > 0)
      return true;
  }
  return false;
}

// m, of the child.
double surge_of(const Partition& partition, const JointRecord& joint, const HomeBody& child, bool is_set) {
  if (!has_effort(joint)) return 0;
  const BodyState now = child.sector->world->state(child.slot);
  const JointSide side = side_of(now);
  const Parent parent = parent_of(partition, joint, child);
  const JointState state = parent.side ? joint_state(joint.properties, *parent.side, side) : JointState{};
  const double speed = side.linear_velocity.norm();
  const double spin = side.angular_velocity.norm();
  const bool is_new = is_set || (speed == 0 && spin == 0);
  double surge = 0;
  for (int axis = 0; axis < axis_count(joint.properties.type); ++axis) {
    const auto n = static_cast<std::size_t>(axis);
    const JointDrive& drive = joint.drives[n];
    if (!parent.stands && !is_new && drive.mode != DriveMode::kEffort) continue;
    const bool is_angle = joint.properties.type != JointType::kPrismatic;
    const AxisState at{parent.side.has_value(), state.position[n],
                       parent.side ? state.velocity[n] : (is_angle ? spin : speed)};
    const AxisMotion motion = motion_of(joint.properties, axis, child);
    const AxisSurge of_axis(joint.properties.axes[n], is_angle, at, motion, partition.dt());
    surge += of_axis.of(drive) * motion.arm;
    if (parent.stands || is_new) surge += of_axis.of_spring() * motion.arm;
  }
  return surge;
}

}  // namespace

void foresee_drives(Partition& partition) {
  std::vector<JointId> set = std::exchange(partition.set_joints, {});
  std::ranges::sort(set);
  for (const BodyId id : partition.jointed) {
    const HomeBody& body = *partition.bodies.at(id);
    SectorWorld& world = *body.sector->world;
    if (body.properties.motion != Motion::kDynamic || world.activity(body.slot) == Activity::kAsleep)
      continue;
    double surge = 0;
    for_each_of_child(partition.joints, id, [&](const JointRecord& joint) {
      surge += surge_of(partition, joint, body, std::ranges::binary_search(set, joint.id));
    });
    if (surge > 0) world.set_surge(body.slot, std::min(world.surge(body.slot) + surge, kSurgeMax));
  }
}

}  // namespace tessera
