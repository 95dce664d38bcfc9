// Wheels that are rays, with springs and tyres, under a dynamic body whose x axis points forwards and whose z
// axis points up: what vehicles and tracks share.
//
// The forces at the wheels are found together, as contacts are: in a few passes over all wheels, each tyre
// holds its point of the ground as far as its grip allows (Catto, "Iterative Dynamics with Temporal
// Coherence", 2005). So a car that is parked on a slope stands, and one that slides is slowed down by no more
// than friction can.
#pragma once

#include <Eigen/Core>
#include <span>

#include "lpss/programs/program.h"

namespace tessera::wheels {

// A body that impulses act on: its velocities as they are going to be at the end of the next tick.
struct Chassis {
  explicit Chassis(const Senses& senses);

  Eigen::Vector3d velocity_at(const Eigen::Vector3d& lever) const { return linear + angular.cross(lever); }
  // N s that change the velocity at a place along a way by 1 m/s.
  double resistance(const Eigen::Vector3d& lever, const Eigen::Vector3d& way) const;
  void push(const Eigen::Vector3d& lever, const Eigen::Vector3d& by);

  double mass;
  Eigen::Matrix3d mobility;
  Eigen::Vector3d linear;
  Eigen::Vector3d angular;
  Eigen::Vector3d impulse = Eigen::Vector3d::Zero();  // N s, of all pushes
  Eigen::Vector3d spin = Eigen::Vector3d::Zero();     // N m s
};

struct Suspension {
  double radius = 0;     // m, of a wheel
  double travel = 0;     // m, of a spring
  double stiffness = 0;  // N/m
  double damping = 0;    // N s/m

  // m, of the ray from the upper end of a spring.
  double reach() const { return travel + radius; }
};

struct Wheel {
  const ProgramFinding* ground = nullptr;  // null: it hangs
  Eigen::Vector3d lever;                   // of its point on the ground, from the centre of mass
  Eigen::Vector3d carried;                 // m/s, of that ground
  Eigen::Vector3d normal;
  Eigen::Vector3d forward;
  Eigen::Vector3d left;
  double compressed = 0;  // m, of its spring
  double load = 0;        // N s, in the next tick
  double engine = 0;      // N s
  double brake = 0;       // N s, at most
  double running = 0;     // m/s, over the ground, at which its rim is held by the brake
  bool slides = false;    // most of the time: friction is exactly against its slip
  Eigen::Vector2d tyre = Eigen::Vector2d::Zero();   // N s, forward and to the left
  Eigen::Vector3d given = Eigen::Vector3d::Zero();  // N s, to the body
};

// Asks what is below a spring whose upper end is at `mount` (m, in the body frame, from the centre of mass).
void ask(const Senses& senses, const Suspension& suspension, const Eigen::Vector3d& mount, Asker& asker);

// The wheel of the n-th question, which rolls along `rolls` (of unit length, in the body frame).
Wheel wheel_at(const Senses& senses, const Chassis& chassis, const Suspension& suspension, std::uint32_t ask,
               const Eigen::Vector3d& rolls);

// What a wheel is told.
struct Drive {
  double throttle = 0;  // -1 to 1
  double engine = 0;    // N, at full throttle
  double speed = 0;     // m/s, from which on the engine does not push
  double brake = 0;     // N
  double grip = 0;
  double rolling = 0;  // resistance, as a part of what the wheel bears
};
void drive(const Senses& senses, const Drive& told, Wheel& wheel);

// The springs lift, the engine pushes, and the tyres hold their points: to the side as far as they grip,
// along their way as far as they are braked.
void solve(Chassis& chassis, std::span<Wheel> wheels, double grip);

// How many stand on something.
double on_ground(std::span<const Wheel> wheels);
// m/s, of the body along its x axis, over what it stands on.
double speed_over_ground(const Senses& senses, std::span<const Wheel> wheels);

// The forces on the body, and their opposites on what it stands on. What `is_driven` does not sleep.
void act(const Senses& senses, const Chassis& chassis, std::span<const Wheel> wheels, bool is_driven,
         Actor& actor);

}  // namespace tessera::wheels
