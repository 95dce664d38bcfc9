#include "lpss/solver/contact_solver.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tessera {
namespace {

// A contact is a spring that its load compresses: at 30 Hz, as in Box2D, a tower of ten boxes is 27 mm lower,
// and one of twenty buckles; at 60 Hz 7 mm, and both stand. Stiffer ones need more passes than is practical.
constexpr double kFrequencyTick = 1;     // of the rate of ticks, at most
constexpr double kFrequencyStep = 0.25;  // of the rate of steps, at most
constexpr double kContactDamping = 10;   // of critical damping
constexpr double kPushSpeedMax = 3;      // m/s, at which overlaps are corrected

// Two directions perpendicular to a unit vector and to each other, by its components alone.
template <typename Vector>
void span_plane(const Vector& normal, Vector& p, Vector& q) {
  using Scalar = typename Vector::Scalar;
  if (std::abs(normal.z()) > Scalar(std::numbers::sqrt2 / 2)) {
    const Scalar scale = 1 / std::sqrt(normal.y() * normal.y() + normal.z() * normal.z());
    p = Vector(0, -normal.z() * scale, normal.y() * scale);
  } else {
    const Scalar scale = 1 / std::sqrt(normal.x() * normal.x() + normal.y() * normal.y());
    p = Vector(-normal.y() * scale, normal.x() * scale, 0);
  }
  q = normal.cross(p);
}

// The velocity of two sides (Side) along a direction, from the velocities of their bodies or changes of them.
template <typename Vector, typename Moving, typename Side>
inline auto relative(const Vector& direction, const Moving& p, const Side& a, const Moving& q,
                     const Side& b) {
  return direction.dot(p.linear - q.linear) + a.angular.dot(p.angular) - b.angular.dot(q.angular);
}

template <typename Scalar>
Scalar inverse_or_zero(Scalar value) {
  return value > 0 ? 1 / value : 0;
}

}  // namespace

template <typename Scalar>
void ContactSolver<Scalar>::begin(const Options& options, std::span<const Body> bodies,
                                  std::span<const Patch> patches) {
  options_ = options;
  bodies_ = bodies;
  step_ = options.time_step / static_cast<Scalar>(options.steps);
  const Scalar stiffer = std::max(Scalar(1), Scalar(options.steps) / Scalar(options.usual_steps));
  const Scalar frequency =
      std::min(stiffer * Scalar(kFrequencyTick) / options.time_step, Scalar(kFrequencyStep) / step_);
  const Scalar omega = 2 * std::numbers::pi_v<Scalar> * frequency;
  const Scalar a = 2 * Scalar(kContactDamping) + step_ * omega;
  const Scalar b = step_ * omega * a;
  push_rate_ = omega / a;
  impulse_share_ = 1 / (1 + b);
  mass_share_ = b * impulse_share_;

  moving_.clear();
  moving_.assign(bodies.size(), {Vector::Zero(), Vector::Zero(), Vector::Zero(), Vector::Zero()});
  patches_.clear();
  normals_.clear();
  for (const Patch& patch : patches) add(patch);
}

template <typename Scalar>
auto ContactSolver<Scalar>::side(const Body& body, const Vector& lever, const Vector& direction) const
    -> Side {
  const Vector angular = lever.cross(direction);
  return {angular, body.inverse_inertia * angular};
}

template <typename Scalar>
void ContactSolver<Scalar>::add(const Patch& patch) {
  const Body& a = bodies_[patch.a];
  const Body& b = bodies_[patch.b];
  PatchRows rows;
  rows.a = patch.a;
  rows.b = patch.b;
  rows.first = normals_.size();
  rows.count = patch.points;
  rows.inverse_mass_a = a.inverse_mass;
  rows.inverse_mass_b = b.inverse_mass;
  rows.friction = patch.friction;
  rows.is_jointed = patch.is_jointed;
  const Scalar share = 1 / static_cast<Scalar>(options_.steps);
  for (std::size_t n = 0; n < patch.points; ++n) {
    const Point& point = patch.point[n];
    NormalRow row;
    row.normal = point.normal;
    row.a = side(a, point.lever_a, point.normal);
    row.b = side(b, point.lever_b, point.normal);
    row.mass = inverse_or_zero(a.inverse_mass + b.inverse_mass + row.a.angular.dot(row.a.response) +
                               row.b.angular.dot(row.b.response));
    row.gap = point.gap;
    row.approach_max = std::min(-point.gap / options_.time_step, Scalar(0));
    row.start = relative(row.normal, bodies_[rows.a], row.a, bodies_[rows.b], row.b);
    row.rebound = -row.start > options_.bounce_from ? patch.restitution * -row.start : 0;
    row.impulse = point.impulse * share;
    normals_.push_back(row);
  }
  add_friction(patch, rows);
  patches_.push_back(rows);
}

// Friction acts at the centre of the points. Its impulse of the last tick is projected on the new plane, and
// limited by the new normal impulses.
template <typename Scalar>
void ContactSolver<Scalar>::add_friction(const Patch& patch, PatchRows& rows) const {
  const Body& a = bodies_[patch.a];
  const Body& b = bodies_[patch.b];
  Vector lever_a = Vector::Zero();
  Vector lever_b = Vector::Zero();
  rows.normal = Vector::Zero();
  for (std::size_t n = 0; n < patch.points; ++n) {
    lever_a += patch.point[n].lever_a;
    lever_b += patch.point[n].lever_b;
    rows.normal += patch.point[n].normal;
  }
  const Scalar count(static_cast<Scalar>(patch.points));
  lever_a /= count;
  lever_b /= count;
  rows.normal.normalize();
  // By the levers of a side that can be pushed: those of the other one say nothing.
  const bool by_a = a.inverse_mass > 0;
  for (std::size_t n = 0; n < patch.points; ++n) {
    const Vector arm = by_a ? patch.point[n].lever_a - lever_a : patch.point[n].lever_b - lever_b;
    rows.radius += arm.norm() / count;
  }

  span_plane(rows.normal, rows.tangent[0], rows.tangent[1]);
  for (int k = 0; k < 2; ++k) {
    rows.tangent_a[k] = side(a, lever_a, rows.tangent[k]);
    rows.tangent_b[k] = side(b, lever_b, rows.tangent[k]);
    rows.start[k] =
        relative(rows.tangent[k], bodies_[rows.a], rows.tangent_a[k], bodies_[rows.b], rows.tangent_b[k]);
  }
  const auto mobility = [&](int i, int j) {
    return rows.tangent_a[i].angular.dot(rows.tangent_a[j].response) +
           rows.tangent_b[i].angular.dot(rows.tangent_b[j].response);
  };
  const Scalar masses = a.inverse_mass + b.inverse_mass;
  const Scalar k00 = masses + mobility(0, 0);
  const Scalar k01 = mobility(0, 1);
  const Scalar k11 = masses + mobility(1, 1);
  const Scalar inverse = inverse_or_zero(k00 * k11 - k01 * k01);
  rows.mass[0] = k11 * inverse;
  rows.mass[1] = -k01 * inverse;
  rows.mass[2] = k00 * inverse;

  rows.twist_start = rows.normal.dot(a.angular - b.angular);
  rows.twist_a = a.inverse_inertia * rows.normal;
  rows.twist_b = b.inverse_inertia * rows.normal;
  rows.twist_mass = inverse_or_zero(rows.normal.dot(rows.twist_a) + rows.normal.dot(rows.twist_b));

  const Scalar share = 1 / static_cast<Scalar>(options_.steps);
  Scalar most = 0;
  for (std::size_t n = 0; n < rows.count; ++n) most += rows.friction * normals_[rows.first + n].impulse;
  for (int k = 0; k < 2; ++k) rows.impulse[k] = patch.friction_impulse.dot(rows.tangent[k]) * share;
  const Scalar length = std::sqrt(rows.impulse[0] * rows.impulse[0] + rows.impulse[1] * rows.impulse[1]);
  if (length > most) {
    for (Scalar& impulse : rows.impulse) impulse *= most / length;
  }
  rows.twist = std::clamp(patch.twist_impulse * share, -most * rows.radius, most * rows.radius);
}

template <typename Scalar>
inline void ContactSolver<Scalar>::push(const PatchRows& rows, const Vector& direction, const Side& a,
                                        const Side& b, Scalar impulse) {
  Moving& p = moving_[rows.a];
  Moving& q = moving_[rows.b];
  p.linear += direction * (rows.inverse_mass_a * impulse);
  p.angular += a.response * impulse;
  q.linear -= direction * (rows.inverse_mass_b * impulse);
  q.angular -= b.response * impulse;
}

template <typename Scalar>
inline void ContactSolver<Scalar>::twist(const PatchRows& rows, Scalar impulse) {
  moving_[rows.a].angular += rows.twist_a * impulse;
  moving_[rows.b].angular -= rows.twist_b * impulse;
}

// Forces of one step, and the impulses of the step before.
template <typename Scalar>
void ContactSolver<Scalar>::start_step() {
  const Scalar share = 1 / static_cast<Scalar>(options_.steps);
  for (std::size_t n = 0; n < moving_.size(); ++n) {
    moving_[n].linear += bodies_[n].linear_force * share;
    moving_[n].angular += bodies_[n].angular_force * share;
  }
  for (const PatchRows& rows : patches_) {
    for (std::size_t n = rows.first; n < rows.first + rows.count; ++n) {
      const NormalRow& row = normals_[n];
      push(rows, row.normal, row.a, row.b, row.impulse);
    }
    for (int k = 0; k < 2; ++k)
      push(rows, rows.tangent[k], rows.tangent_a[k], rows.tangent_b[k], rows.impulse[k]);
    twist(rows, rows.twist);
  }
}

template <typename Scalar>
void ContactSolver<Scalar>::pass(bool biased) {
  for (PatchRows& rows : patches_) {
    if (!biased || rows.is_jointed) solve_friction(rows);
    for (std::size_t n = rows.first; n < rows.first + rows.count; ++n)
      solve_normal(rows, normals_[n], biased);
  }
}

// A gap may close by the end of the tick; an overlap is opened like an overdamped spring.
template <typename Scalar>
inline void ContactSolver<Scalar>::solve_normal(const PatchRows& rows, NormalRow& row, bool biased) {
  Scalar wanted = row.approach_max;
  Scalar mass_share = 1;
  Scalar impulse_share = 0;
  if (biased && row.gap < 0) {
    wanted = std::min(-row.gap * push_rate_, Scalar(kPushSpeedMax));
    mass_share = mass_share_;
    impulse_share = impulse_share_;
  }
  const Scalar missing =
      wanted - (row.start + relative(row.normal, moving_[rows.a], row.a, moving_[rows.b], row.b));
  const Scalar impulse =
      std::max(row.impulse * (1 - impulse_share) + missing * row.mass * mass_share, Scalar(0));
  push(rows, row.normal, row.a, row.b, impulse - row.impulse);
  row.impulse = impulse;
}

template <typename Scalar>
inline void ContactSolver<Scalar>::solve_friction(PatchRows& rows) {
  Scalar most = 0;
  for (std::size_t n = rows.first; n < rows.first + rows.count; ++n) most += normals_[n].impulse;
  most *= rows.friction;

  Scalar slide[2];
  for (int k = 0; k < 2; ++k)
    slide[k] = rows.start[k] + relative(rows.tangent[k], moving_[rows.a], rows.tangent_a[k], moving_[rows.b],
                                        rows.tangent_b[k]);
  Scalar wanted[2] = {rows.impulse[0] - (rows.mass[0] * slide[0] + rows.mass[1] * slide[1]),
                      rows.impulse[1] - (rows.mass[1] * slide[0] + rows.mass[2] * slide[1])};
  const Scalar length = std::sqrt(wanted[0] * wanted[0] + wanted[1] * wanted[1]);
  const Scalar scale = length > most ? most / length : Scalar(1);
  for (int k = 0; k < 2; ++k) {
    wanted[k] *= scale;
    push(rows, rows.tangent[k], rows.tangent_a[k], rows.tangent_b[k], wanted[k] - rows.impulse[k]);
    rows.impulse[k] = wanted[k];
  }

  const Scalar spin = rows.twist_start + rows.normal.dot(moving_[rows.a].angular - moving_[rows.b].angular);
  const Scalar twist_max = most * rows.radius;
  const Scalar turned = std::clamp(rows.twist - rows.twist_mass * spin, -twist_max, twist_max);
  twist(rows, turned - rows.twist);
  rows.twist = turned;
}

// Bodies move by the velocities of the biased passes; what the relaxed pass takes back, end_step() does.
template <typename Scalar>
void ContactSolver<Scalar>::advance() {
  for (PatchRows& rows : patches_) {
    for (std::size_t n = rows.first; n < rows.first + rows.count; ++n) {
      NormalRow& row = normals_[n];
      row.gap += (row.start + relative(row.normal, moving_[rows.a], row.a, moving_[rows.b], row.b)) * step_;
    }
  }
  for (Moving& body : moving_) {
    body.way += body.linear * step_;
    body.turn += body.angular * step_;
  }
}

// The way of the biased passes without that of the velocities that stay is what opened overlaps.
template <typename Scalar>
void ContactSolver<Scalar>::end_step() {
  for (Moving& body : moving_) {
    body.way -= body.linear * step_;
    body.turn -= body.angular * step_;
  }
  for (NormalRow& row : normals_) row.total += row.impulse;
  for (PatchRows& rows : patches_) {
    for (int k = 0; k < 2; ++k) rows.total[k] += rows.impulse[k];
    rows.twist_total += rows.twist;
  }
}

template <typename Scalar>
void ContactSolver<Scalar>::rebound() {
  for (PatchRows& rows : patches_) {
    for (std::size_t n = rows.first; n < rows.first + rows.count; ++n) {
      NormalRow& row = normals_[n];
      if (!(row.rebound > 0) || !(row.total > 0)) continue;
      const Scalar missing =
          row.rebound - (row.start + relative(row.normal, moving_[rows.a], row.a, moving_[rows.b], row.b));
      const Scalar impulse = std::max(row.impulse + missing * row.mass, Scalar(0));
      push(rows, row.normal, row.a, row.b, impulse - row.impulse);
      row.total += impulse - row.impulse;
      row.impulse = impulse;
    }
  }
}

template <typename Scalar>
void ContactSolver<Scalar>::end(std::span<Patch> patches) const {
  for (std::size_t p = 0; p < patches_.size(); ++p) {
    const PatchRows& rows = patches_[p];
    for (std::size_t n = 0; n < rows.count; ++n) patches[p].point[n].impulse = normals_[rows.first + n].total;
    patches[p].friction_impulse = rows.tangent[0] * rows.total[0] + rows.tangent[1] * rows.total[1];
    patches[p].twist_impulse = rows.twist_total;
  }
}

template class ContactSolver<float>;
template class ContactSolver<double>;

}  // namespace tessera
