#include "lpss/native/body.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "lpss/base/columns.h"
#include "lpss/base/portable_math.h"
#include "lpss/base/rotation.h"
#include "lpss/base/torque_free.h"

namespace tessera::native {
namespace {

// Of the velocity after `dt` seconds, for a damping by the second.
Scalar left_after(double damping, double dt) {
  return damping > 0 ? Scalar(portable::pow(1 - damping, dt)) : Scalar(1);
}

// How much more easily a body turns than a block of its mass around its shape would; 1 where that is no more
// than how mass is spread in a body explains.
Scalar nimbleness_of(const Body& body, double mass) {
  constexpr double kExplained = 8;
  const Bounds& bounds = body.solid->bounds();
  const Vector reach = bounds.low.cwiseAbs().cwiseMax(bounds.high.cwiseAbs());
  const Vector squares = reach.cwiseAbs2();
  const Vector of_block = (Vector::Constant(squares.sum()) - squares) * Scalar(mass / 3);
  const Scalar most = of_block.cwiseProduct(body.inverse_moments).maxCoeff();
  return most > Scalar(kExplained) ? most : Scalar(1);
}

}  // namespace

Body::Body(const BodyRecord& record, Role r, std::shared_ptr<const Solid> s, const EngineSettings& settings)
    : role(r),
      motion(record.properties.motion),
      linear_damping(left_after(record.properties.linear_damping, settings.time_step)),
      angular_damping(left_after(record.properties.angular_damping, settings.time_step)),
      id(record.id),
      category(record.properties.category),
      mask(record.properties.mask),
      assembly(record.properties.assembly),
      feels_gravity(record.properties.gravity || record.home.frame != kWorldFrame),
      principal_axes(centre_frame(record.properties).orientation.toRotationMatrix().cast<Scalar>()),
      friction(Scalar(record.properties.friction)),
      restitution(Scalar(record.properties.restitution)),
      solid(std::move(s)) {
  const bool is_damped = linear_damping != 1 || angular_damping != 1;
  flies_fine = settings.fine_flight && is_dynamic() && !is_damped;
  flies_jointed = settings.jointed_flight && is_dynamic() && !is_damped && feels_gravity;
  if (is_dynamic()) {
    set_mass(record.properties.mass, record.properties.inertia);
    // Half the extent of the thinnest part.
    for (const SweptBall& ball : solid->swept_balls()) {
      const Scalar beyond = ball.radius * Scalar(1.25);
      swept_beyond = swept_beyond > 0 ? std::min(swept_beyond, beyond) : beyond;
    }
    still_limits = tessera::still_limits<Scalar>(settings, double(solid->extent()), double(solid->radius()));
  }
  set_state(record.state);
  if (record.properties.surface) set_surface(*record.properties.surface);
}

Body::Body(const Body& other, const Frame& at)
    : pose(at),
      role(other.role),
      motion(other.motion),
      inverse_mass(other.inverse_mass),
      linear_damping(other.linear_damping),
      angular_damping(other.angular_damping),
      start(at.position),
      start_rotation(at.rotation),
      id(other.id),
      category(other.category),
      mask(other.mask),
      assembly(other.assembly),
      feels_gravity(other.feels_gravity),
      flies_fine(other.flies_fine),
      principal_axes(other.principal_axes),
      friction(other.friction),
      restitution(other.restitution),
      still_limits(other.still_limits),
      solid(other.solid),
      rounding(other.rounding) {}

Scalar Body::swing(Scalar dt) const {
  constexpr Scalar kQuarterTurn = Scalar(1.6);  // rad
  if (angular.isZero(0)) return 0;
  const Vector axis = pose.rotation * solid->round_axis();
  const Scalar turn = (angular - axis * axis.dot(angular)).norm() * dt;
  return std::min(turn, kQuarterTurn) * solid->swing();
}

Scalar Body::surge_of(const Wrench& wrench, Scalar dt) const {
  if (!is_dynamic()) return 0;
  const Vector turn = (pose.rotation.transpose() * vector(wrench.torque)).cwiseProduct(inverse_moments);
  const Scalar acceleration = vector(wrench.force).norm() * inverse_mass + turn.norm() * solid->swing();
  const Scalar way = acceleration * (dt * dt);
  return way < Scalar(kSurgeMax) ? way : Scalar(kSurgeMax);  // also of what is no number
}

void Body::set_mass(double mass, const std::array<double, 3>& principal_moments) {
  inverse_mass = Scalar(1 / mass);
  moments = vector(principal_moments);
  inverse_moments = moments.cwiseInverse();
  nimbleness = nimbleness_of(*this, mass);
}

void Body::set_surface(const Surface& given) {
  const auto in_centre_frame = [&](const std::array<double, 3>& v) -> Vector {
    return motion == Motion::kStatic ? vector(v) : Vector(principal_axes.transpose() * vector(v));
  };
  const Eigen::Vector3d direction = Eigen::Vector3d(given.direction.data()).stableNormalized();
  surface = std::make_unique<const BodySurface>(BodySurface{
      in_centre_frame(array(Vector(direction.cast<Scalar>()))), Scalar(given.second_friction),
      Scalar(given.torsional_friction), Scalar(given.patch_radius), Scalar(given.rolling_friction),
      in_centre_frame(given.velocity), in_centre_frame(given.running)});
}

void Body::set_sensor(Sensor given) {
  given.category = category;
  given.mask = mask;
  if (given.is_whole) category = mask = 0;
  sensor = std::make_unique<const Sensor>(std::move(given));
}

BodyState Body::state() const {
  if (motion == Motion::kStatic) return *static_state;
  BodyState state;
  const FineFlight at = fine.value_or(rounded());
  Eigen::Map<Eigen::Vector3d>(state.position.data()) = at.position;
  state.rotation = array(pose.rotation);
  Eigen::Map<Eigen::Vector3d>(state.linear_velocity.data()) = at.velocity;
  state.angular_velocity = array(angular);
  state.still_for = double(still_for);
  state.activity = activity;
  if (motion == Motion::kKinematic && (linear != linear_before || angular != angular_before))
    state.velocities_before = {array(linear_before), array(angular_before)};
  return state;
}

void Body::set_state(const BodyState& state) {
  pose = {matrix(state.rotation), vector(state.position)};
  start = pose.position;
  start_rotation = pose.rotation;
  still_for = Scalar(state.still_for);
  if (motion == Motion::kStatic) {
    static_state = std::make_unique<BodyState>(state);
    pose = pose * solid->offset();
    rounding = pose.position.cwiseAbs().maxCoeff() * (2 * std::numeric_limits<Scalar>::epsilon());
    activity = Activity::kAsleep;
    return;
  }
  fine.reset();
  if (flies_fine) {
    fine = {Eigen::Vector3d(state.position.data()), Eigen::Vector3d(state.linear_velocity.data())};
  }
  linear = vector(state.linear_velocity);
  angular = vector(state.angular_velocity);
  linear_before = state.velocities_before ? vector(state.velocities_before->linear) : linear;
  angular_before = state.velocities_before ? vector(state.velocities_before->angular) : angular;
  activity = state.activity;
}

Vector Body::angular_push(Scalar dt) const {
  const Vector in_body = pose.rotation.transpose() * torque;
  return pose.rotation * Vector(in_body.cwiseProduct(inverse_moments) * dt);
}

void Body::coast(Scalar dt) {
  const Vector push = linear_push(dt);
  linear += push;
  angular += angular_push(dt);
  pose.position -= push * (dt / 2);
}

// The turning itself has the mean already: that of a body that nothing else pushes.
void Body::turn_late(const Vector& linear_change, const Vector& angular_change, Scalar dt) {
  const Vector spin = turning->spin.cast<Scalar>();
  linear -= spin.cross(Vector(linear_change - turning->acceleration.cast<Scalar>() * dt)) * dt;
  // As Felt::torque() has it, along the principal axes.
  const auto back = pose.rotation.transpose();
  const Vector turn = back * spin;
  const Vector given = back * turning->torque.cast<Scalar>();
  const Vector change = back * angular_change - given.cwiseProduct(inverse_moments) * dt;
  const Vector late = moments.cwiseProduct(change.cross(turn)) -
                      turn.cross(Vector(moments.cwiseProduct(change))) +
                      Vector(moments.cwiseProduct(turn)).cross(change);
  angular += pose.rotation * Vector(late.cwiseProduct(inverse_moments) * (dt / 2));
}

std::optional<DivergenceKind> Body::divergence() const {
  return divergence_of(linear.cast<double>(), angular.cast<double>(), double(solid->radius()));
}

void Body::stop() {
  pose.position = start;
  linear.setZero();
  angular.setZero();
  next = pose;
  next_angular.setZero();
  still_for = 0;
  coasts = false;
  flies = false;
  fine.reset();
  if (flies_fine) fine = rounded();
}

namespace {

// One step of Newton's method towards the nearest rotation: rounding does not add up.
Eigen::Matrix3d straightened(const Eigen::Matrix3d& axes) {
  return axes * (Eigen::Matrix3d::Identity() * 1.5 - axes.transpose() * axes * 0.5);
}

}  // namespace

Matrix turned(const Matrix& rotation, const Vector& turn) {
  if (turn.isZero(0)) return rotation;
  const Matrix by = rotation_by(turn.cast<double>()).toRotationMatrix().cast<Scalar>();
  return Columns<Scalar>::straightened_product(by, rotation);
}

void Body::foresee(Scalar dt) {
  next.position = pose.position + linear * dt;
  next_angular = angular;
  const bool is_alike = moments.x() == moments.y() && moments.y() == moments.z();
  if (jointed || is_alike || angular.isZero(0)) {
    next.rotation = turned(pose.rotation, angular * dt);
    return;
  }
  const Spin end =
      torque_free({pose.rotation.cast<double>(), angular.cast<double>()}, moments.cast<double>(), dt);
  next.rotation = straightened(end.axes).cast<Scalar>();
  next_angular = end.rate.cast<Scalar>();
}

bool is_wanted_pair(const Body& a, const Body& b) {
  if (!a.is_dynamic() && !b.is_dynamic()) return false;
  if (a.assembly != 0 && a.assembly == b.assembly) return false;
  // The home of the dynamic body detects, or the lower home of two: a clone meets only dynamic bodies at
  // home.
  const auto lives_here = [](const Body& body) { return body.role == Role::kHome && body.is_dynamic(); };
  if (a.role == Role::kClone && !lives_here(b)) return false;
  if (b.role == Role::kClone && !lives_here(a)) return false;
  return (a.category & b.mask) != 0 && (b.category & a.mask) != 0;
}

}  // namespace tessera::native
