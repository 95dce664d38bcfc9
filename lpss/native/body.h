// One body of a sector's world.
#pragma once

#include <memory>
#include <optional>

#include "lpss/base/columns.h"
#include "lpss/base/rotation.h"
#include "lpss/engine/engine.h"
#include "lpss/engine/still_clock.h"
#include "lpss/native/solid.h"

struct btDbvtNode;

namespace tessera::native {

// The state of a body in free flight, finer than the engine's numbers (EngineSettings::fine_flight), which
// are this state rounded.
struct FineFlight {
  Eigen::Vector3d position;
  Eigen::Vector3d velocity;
};

// What of a body is a trigger.
struct Sensor {
  std::shared_ptr<const Solid> triggers;
  // Of a body that is a trigger as a whole, its other parts; null if there are none.
  std::shared_ptr<const Solid> others;
  bool is_whole = false;  // nothing of the body touches anything
  std::uint32_t category = 0;
  std::uint32_t mask = 0;
};

struct Body {
  Body(const BodyRecord& record, Role role, std::shared_ptr<const Solid> solid,
       const EngineSettings& settings);

  // What finding contacts looks at of a body that is not static, with the body elsewhere.
  Body(const Body& other, const Frame& at);

  bool is_dynamic() const { return motion == Motion::kDynamic; }
  bool is_awake() const { return activity != Activity::kAsleep; }
  bool lives_here() const { return role == Role::kHome && motion != Motion::kStatic; }

  BodyState state() const;
  void set_state(const BodyState& state);
  void set_mass(double mass, const std::array<double, 3>& principal_moments);
  void set_surface(const Surface& given);
  // What is a trigger as a whole has no category left that contacts and queries could meet.
  void set_sensor(Sensor given);
  FineFlight rounded() const { return {pose.position.cast<double>(), linear.cast<double>()}; }

  // 1/(kg m^2), world axes.
  Matrix inverse_inertia() const {
    return Columns<Scalar>(pose.rotation * inverse_moments.asDiagonal()).times_transposed(pose.rotation);
  }

  // m, how far a point gets in `dt` seconds at most, by how the body turns, to where nothing of it was.
  Scalar swing(Scalar dt) const;

  // m, how much farther a point may get by a wrench that acts for `dt` seconds.
  Scalar surge_of(const Wrench& wrench, Scalar dt) const;

  // What forces of the tick add to the velocities in `dt` seconds.
  Vector linear_push(Scalar dt) const { return force * (inverse_mass * dt); }
  Vector angular_push(Scalar dt) const;

  // m/s^2, of all other forces of the tick: exactly 0 if there are none.
  Eigen::Vector3d other_pull() const {
    const Vector others = force - pull() / inverse_mass;
    return others.cast<double>() * double(inverse_mass);
  }

  // m/s^2, without forces: gravity, and what its frame adds.
  Vector pull() const { return turning ? Vector(gravity + turning->acceleration.cast<Scalar>()) : gravity; }

  // Free flight: the velocities at the end of a tick, and the position from which they lead there in `dt`
  // seconds: x = v t - a t^2 / 2 with v at the end, the parabola. Around a planet, where the pull at the end
  // is another one, SectorWorld::end_flight() completes v: leapfrog, which keeps orbits.
  void coast(Scalar dt);

  // In a frame that turns, once a step of `dt` seconds has changed its velocities by these (m/s, rad/s): half
  // of what the Coriolis force and the gyroscopic torque are more at the end than at the beginning. By the
  // mean over the step they do no work; half a step late, they would turn the plane of a pendulum.
  void turn_late(const Vector& linear_change, const Vector& angular_change, Scalar dt);

  // Where its velocities are out of range: back at the start of the tick, and at rest.
  std::optional<DivergenceKind> divergence() const;
  void stop();

  // Sets `next` and `next_angular`.
  void foresee(Scalar dt);

  Bounds bounds_at(const Frame& at) const { return solid->bounds_at(at).grown(solid->margin() + rounding); }

  // What loops over all bodies look at comes first.
  Frame pose;
  Vector linear = Vector::Zero();   // m/s
  Vector angular = Vector::Zero();  // rad/s
  Scalar still_for = 0;             // s
  Activity activity = Activity::kAwake;
  Role role;
  Motion motion;
  Range range = Range::kUsual;
  bool coasts = false;  // until integrate()
  bool flies = false;   // SectorWorld::flew()
  btDbvtNode* leaf = nullptr;
  std::unique_ptr<const BodySurface> surface;  // none: one like any other
  std::unique_ptr<const FrameTurn> turning;    // of a frame that turns
  Bounds bounds;  // what pairs are found by: of the last detection, with the distance at which contacts are
                  // found
  Vector gravity = Vector::Zero();  // m/s^2
  Vector force = Vector::Zero();    // N, in this tick
  Vector torque = Vector::Zero();   // N m
  Scalar inverse_mass = 0;          // 1/kg; 0 for what cannot be pushed
  Scalar nimbleness = 1;            // ContactScale::nimbleness
  Scalar linear_damping;            // the share of the velocity that is left after a tick
  Scalar angular_damping;
  Scalar swept_beyond = 0;   // m per tick; 0: never swept
  Scalar surge = 0;          // m, SectorWorld::surge()
  bool is_foreseen = false;  // in this detection, by its course (meetings.h)
  Vector start;              // the position before the solver pushed it; otherwise that of the pose
  Matrix start_rotation;     // likewise
  Frame next;                // where integrate() moves the body
  Vector next_angular;       // rad/s, there
  Bounds enlarged;           // in the tree of the broad phase; holds `bounds`

  BodyId id;
  std::uint32_t category;
  std::uint32_t mask;
  std::uint64_t assembly;
  bool feels_gravity;
  bool flies_fine;
  bool flies_jointed;  // EngineSettings::jointed_flight, unless its frame turns
  bool jointed = false;
  bool has_left = false;                    // its enlarged box, in this detection
  Bounds left;                              // the enlarged box before this detection
  Vector moments = Vector::Zero();          // kg m^2, principal
  Vector inverse_moments = Vector::Zero();  // 1/(kg m^2)
  Matrix principal_axes;                    // from the centre to the body frame
  Scalar friction;
  Scalar restitution;
  StillLimits<Scalar> still_limits;
  std::shared_ptr<const Solid> solid;
  Eigen::Vector3d exact_gravity = Eigen::Vector3d::Zero();  // `gravity`, not rounded
  std::optional<FineFlight> fine;  // none if the engine's numbers are the exact state
  // Of kinematic bodies: those before the tick, from which they come to the others evenly (carrier.h).
  Vector linear_before = Vector::Zero();    // m/s
  Vector angular_before = Vector::Zero();   // rad/s
  Scalar rounding = 0;                      // m, of where a static body is
  std::unique_ptr<BodyState> static_state;  // of static bodies, whose pose includes the offset of their shape
  std::unique_ptr<const Sensor> sensor;     // none: nothing of it is a trigger
};

// Whether bounds are of numbers, and of a reasonable size: a body without such is not looked for.
inline bool is_sensible(const Bounds& bounds) {
  return (bounds.high - bounds.low).squaredNorm() < Scalar(1e12);
}

// A rotation by `turn` (rad, world axes) after `rotation`.
Matrix turned(const Matrix& rotation, const Vector& turn);

// Whether contacts of the pair are detected, as far as properties and roles decide.
bool is_wanted_pair(const Body& a, const Body& b);

// Whether a wanted pair is left to the other one's home in this tick (Range).
inline bool is_found_elsewhere(const Body& a, const Body& b) {
  if (a.range == Range::kUsual && b.range == Range::kUsual) return false;
  const auto leaves = [](const Body& home, const Body& clone) {
    if (clone.role != Role::kClone || clone.motion != Motion::kDynamic || home.range == Range::kUsual)
      return false;
    if (clone.range == Range::kUsual) return true;
    const Scalar ahead = home.linear.squaredNorm() - clone.linear.squaredNorm();
    return ahead > 0 || (ahead == 0 && clone.range == Range::kFastFromBelow);
  };
  return leaves(a, b) || leaves(b, a);
}

}  // namespace tessera::native
