#include "lpss/programs/wheels.h"

#include <algorithm>
#include <cmath>

#include "lpss/base/rotation.h"

namespace tessera::wheels {
namespace {

constexpr std::size_t kPassesPerWheel = 4;

void set_load(const Senses& senses, const Chassis& chassis, const Suspension& suspension, Wheel& wheel) {
  const double sinking =
      -(senses.velocity() + senses.angular_velocity().cross(wheel.lever) - wheel.carried).dot(wheel.normal);
  const double force = suspension.stiffness * wheel.compressed + suspension.damping * sinking;
  // A damper stops what sinks, and does not throw it back.
  const double most = chassis.resistance(wheel.lever, wheel.normal) * std::max(sinking, 0.0) +
                      suspension.stiffness * wheel.compressed * senses.dt;
  wheel.load = std::clamp(force * senses.dt, 0.0, most);
}

void push(Chassis& chassis, Wheel& wheel, const Eigen::Vector3d& by) {
  chassis.push(wheel.lever, by);
  wheel.given += by;
}

void hold(Chassis& chassis, Wheel& wheel, double grip) {
  const Eigen::Vector3d slip = chassis.velocity_at(wheel.lever) - wheel.carried;
  double along = chassis.resistance(wheel.lever, wheel.forward);
  double across = chassis.resistance(wheel.lever, wheel.left);
  if (wheel.slides) along = across = std::min(along, across);
  Eigen::Vector2d next = wheel.tyre;
  next.x() -= along * (slip.dot(wheel.forward) - wheel.running);
  next.x() = std::clamp(next.x(), -wheel.brake, wheel.brake);
  next.y() -= across * slip.dot(wheel.left);
  // The engine takes its part of the grip.
  const Eigen::Vector2d all(next.x() + wheel.engine, next.y());
  const double most = grip * wheel.load;
  if (const double length = all.norm(); length > most) {
    next = all * (most / length);
    next.x() -= wheel.engine;
  }
  const Eigen::Vector2d change = next - wheel.tyre;
  wheel.tyre = next;
  push(chassis, wheel, wheel.forward * change.x() + wheel.left * change.y());
}

}  // namespace

Chassis::Chassis(const Senses& senses)
    : mass(senses.properties.mass), linear(senses.velocity()), angular(senses.angular_velocity()) {
  const Eigen::Matrix3d axes =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(senses.state.rotation.data());
  const Eigen::Vector3d inertia(senses.properties.inertia.data());
  mobility = tensor_along(axes, Eigen::Vector3d(inertia.cwiseInverse()));
  if (senses.properties.gravity) linear += senses.gravity * senses.dt;
}

double Chassis::resistance(const Eigen::Vector3d& lever, const Eigen::Vector3d& way) const {
  const Eigen::Vector3d turn = lever.cross(way);
  return 1 / (1 / mass + turn.dot(mobility * turn));
}

void Chassis::push(const Eigen::Vector3d& lever, const Eigen::Vector3d& by) {
  linear += by / mass;
  angular += mobility * lever.cross(by);
  impulse += by;
  spin += lever.cross(by);
}

void ask(const Senses& senses, const Suspension& suspension, const Eigen::Vector3d& mount, Asker& asker) {
  const Eigen::Quaterniond turn = senses.orientation();
  asker.cast(senses.position() + turn * mount, turn * -Eigen::Vector3d::UnitZ(), suspension.reach());
}

Wheel wheel_at(const Senses& senses, const Chassis& chassis, const Suspension& suspension, std::uint32_t ask,
               const Eigen::Vector3d& rolls) {
  Wheel wheel;
  const std::span<const ProgramFinding> hit = senses.of(ask);
  if (hit.empty()) return wheel;
  wheel.ground = &hit.front();
  wheel.lever = Eigen::Vector3d(wheel.ground->point.data()) - senses.position();
  wheel.carried = Eigen::Vector3d(wheel.ground->velocity.data());
  wheel.normal = Eigen::Vector3d(wheel.ground->normal.data());
  wheel.left = wheel.normal.cross(senses.orientation() * rolls).normalized();
  wheel.forward = wheel.left.cross(wheel.normal);
  wheel.compressed = suspension.reach() - wheel.ground->distance;
  set_load(senses, chassis, suspension, wheel);
  return wheel;
}

void drive(const Senses& senses, const Drive& told, Wheel& wheel) {
  const double speed = (senses.velocity() - wheel.carried).dot(wheel.forward);
  const bool pushes = told.throttle * speed < std::abs(told.throttle) * told.speed;
  if (pushes) wheel.engine = told.throttle * told.engine * senses.dt;
  wheel.engine = std::clamp(wheel.engine, -told.grip * wheel.load, told.grip * wheel.load);
  wheel.brake = told.brake * senses.dt;
  // What neither drives nor brakes still rolls to a stand.
  if (told.throttle == 0) wheel.brake = std::max(wheel.brake, told.rolling * wheel.load);
}

void solve(Chassis& chassis, std::span<Wheel> wheels, double grip) {
  for (Wheel& wheel : wheels) {
    if (wheel.ground == nullptr) continue;
    push(chassis, wheel, wheel.normal * wheel.load + wheel.forward * wheel.engine);
  }
  for (std::size_t pass = 0; pass < kPassesPerWheel * wheels.size(); ++pass) {
    for (Wheel& wheel : wheels) {
      if (wheel.ground != nullptr) hold(chassis, wheel, grip);
    }
  }
}

double on_ground(std::span<const Wheel> wheels) {
  return static_cast<double>(
      std::ranges::count_if(wheels, [](const Wheel& wheel) { return wheel.ground != nullptr; }));
}

double speed_over_ground(const Senses& senses, std::span<const Wheel> wheels) {
  Eigen::Vector3d carried = Eigen::Vector3d::Zero();
  for (const Wheel& wheel : wheels) {
    if (wheel.ground != nullptr) carried += wheel.carried;
  }
  if (const double count = on_ground(wheels); count > 0) carried /= count;
  return (senses.velocity() - carried).dot(senses.orientation() * Eigen::Vector3d::UnitX());
}

void act(const Senses& senses, const Chassis& chassis, std::span<const Wheel> wheels, bool is_driven,
         Actor& actor) {
  const Eigen::Vector3d force = chassis.impulse / senses.dt;
  const Eigen::Vector3d torque = chassis.spin / senses.dt;
  const auto moves = [](const Wheel& wheel) {
    return wheel.ground != nullptr && wheel.ground->motion != Motion::kStatic;
  };
  if (is_driven || std::ranges::any_of(wheels, moves)) {
    actor.push_awake(force, torque);
    actor.wake_in(1);
  } else {
    actor.push(force, torque);
  }
  for (const Wheel& wheel : wheels) {
    if (wheel.ground == nullptr || wheel.ground->motion != Motion::kDynamic) continue;
    actor.impulse(
        wheel.ground->body, -wheel.given,
        Eigen::Vector3d(wheel.ground->point.data()) - Eigen::Vector3d(wheel.ground->position.data()));
  }
}

}  // namespace tessera::wheels
