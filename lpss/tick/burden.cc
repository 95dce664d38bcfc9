#include "lpss/tick/burden.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "lpss/model/gravity.h"
#include "lpss/model/limits.h"
#include "lpss/partition/bodies.h"

namespace tessera {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// The sums as numbers; in the frame, about a point of it.
struct Burden {
  double mass = 0;                       // kg
  Vector3d first = Vector3d::Zero();     // kg m
  Matrix3d second = Matrix3d::Zero();    // kg m^2, of places alone
  Matrix3d inertia = Matrix3d::Zero();   // kg m^2, of all as one rigid body
  Vector3d momentum = Vector3d::Zero();  // kg m/s, against the frame
  Vector3d spin = Vector3d::Zero();      // kg m^2/s, likewise
};

Matrix3d symmetric(const std::array<ExactSum, 6>& sums) {
  Matrix3d m;
  m << sums[0].value(), sums[1].value(), sums[2].value(), sums[1].value(), sums[3].value(), sums[4].value(),
      sums[2].value(), sums[4].value(), sums[5].value();
  return m;
}

Vector3d vector(const std::array<ExactSum, 3>& sums) {
  return {sums[0].value(), sums[1].value(), sums[2].value()};
}

void add(const Vector3d& v, std::array<ExactSum, 3>& sums) {
  for (std::size_t n = 0; n < 3; ++n) sums[n].add(v[static_cast<int>(n)]);
}

void add(const Matrix3d& m, std::array<ExactSum, 6>& sums) {
  const std::array<double, 6> values = {m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2)};
  for (std::size_t n = 0; n < 6; ++n) sums[n].add(values[n]);
}

// About a point of the frame.
Burden about(const BurdenSums& sums, const Vector3d& point) {
  Burden burden;
  burden.mass = sums.mass.value();
  const Vector3d first = vector(sums.first);
  burden.first = first - burden.mass * point;
  burden.second = symmetric(sums.second) - first * point.transpose() - point * first.transpose() +
                  burden.mass * point * point.transpose();
  burden.inertia = burden.second.trace() * Matrix3d::Identity() - burden.second + symmetric(sums.inertia);
  burden.momentum = vector(sums.momentum);
  burden.spin = vector(sums.spin) - point.cross(burden.momentum);
  return burden;
}

// A frame with a carrier in a tick, seen from the origin of its parent along axes that do not turn, in which
// momentum is what it is.
struct FrameStep {
  FramePlace from;
  FramePlace to;
  Vector3d origin_change = Vector3d::Zero();                 // m/s, of the parent's origin
  Eigen::Quaterniond axes = Eigen::Quaterniond::Identity();  // from the parent's, at the end
  Vector3d spin_change = Vector3d::Zero();                   // rad/s, against the parent
};

// From the origin of `outer`, in which it is at `place`.
FramePlace seen_from(const FramePlace& outer, const FramePlace& place, FrameNumber parent,
                     double sector_size) {
  const Vector3d arm = outer.orientation * relative_to(place.origin, {0, 0, 0, parent}, sector_size);
  FramePlace seen;
  seen.origin = {outer.origin.sector, outer.origin.local + arm};
  seen.orientation = outer.orientation * place.orientation;
  seen.velocity = outer.orientation * place.velocity + outer.spin.cross(arm);
  seen.spin = outer.spin + outer.orientation * place.spin;
  return seen;
}

absl::StatusOr<FramePlace> place_in_world(const WorldSettings& settings, FrameNumber frame, double time,
                                          const std::vector<CarriedFrame>& all) {
  const auto carried = std::ranges::find(all, frame, &CarriedFrame::frame);
  absl::StatusOr<FramePlace> own = carried == all.end() ? frame_place(settings, frame, time) : carried->place;
  const FrameNumber parent = settings.frames[frame - 1].parent();
  if (!own.ok() || parent == kWorldFrame) return own;
  absl::StatusOr<FramePlace> outer = place_in_world(settings, parent, time, all);
  if (!outer.ok()) return outer;
  FramePlace place = seen_from(*outer, *own, parent, settings.sector_size);
  const absl::StatusOr<WorldPosition> origin =
      canonical(place.origin.sector, place.origin.local, settings.sector_size);
  if (!origin.ok()) return origin.status();
  place.origin = *origin;
  place.velocity += outer->velocity;
  return place;
}

// Fails where the parent is beyond the 64-bit range of sectors.
absl::StatusOr<FrameStep> step_of(const Partition& partition, Tick tick,
                                  const std::vector<CarriedFrame>& before, const CarriedFrame& was,
                                  const CarriedFrame& is) {
  const WorldSettings& settings = partition.settings;
  const FrameNumber parent = settings.frames[is.frame - 1].parent();
  FrameStep step{was.place, is.place};
  step.spin_change = is.place.spin - was.place.spin;
  if (parent == kWorldFrame) return step;
  const double time = static_cast<double>(tick) * partition.dt();
  const absl::StatusOr<FramePlace> from = place_in_world(settings, parent, time - partition.dt(), before);
  const absl::StatusOr<FramePlace> to = place_in_world(settings, parent, time, partition.carried);
  if (!from.ok()) return from.status();
  if (!to.ok()) return to.status();
  step.from = seen_from(*from, was.place, parent, settings.sector_size);
  step.to = seen_from(*to, is.place, parent, settings.sector_size);
  step.origin_change = to->velocity - from->velocity;
  step.axes = to->orientation;
  return step;
}

// Of what is aboard, against a carrier that is turned like its frame; axes that do not turn, about its centre
// of mass.
struct Relative {
  Vector3d linear;   // kg m/s
  Vector3d angular;  // kg m^2/s
};

Relative relative(const Burden& burden, const FramePlace& place) {
  const Vector3d spin = place.orientation.conjugate() * place.spin;
  return {place.orientation * Vector3d(burden.momentum + spin.cross(burden.first)),
          place.orientation * Vector3d(burden.inertia * spin + burden.spin)};
}

// m/s, of a point of the frame.
Vector3d velocity_at(const FramePlace& place, const Vector3d& point) {
  return place.velocity + place.spin.cross(place.orientation * point);
}

// m/s^2, by gravity at a point of the frame.
Vector3d pull_at(const Partition& partition, const FramePlace& place, const Vector3d& point) {
  return acceleration_at(partition.settings.gravity, place.origin.sector,
                         place.origin.local + place.orientation * point, partition.sector_size());
}

// What the pull of a planet gives in a tick to what is aboard, beyond what it gives at the carrier's centre
// of mass, `point` of the frame: the tide, to first order.
Relative tide(const Partition& partition, const CentralGravity& planet, const FramePlace& place,
              const Vector3d& point, const Burden& burden) {
  const Matrix3d axes = place.orientation.toRotationMatrix();
  const WorldPosition centre{place.origin.sector, place.origin.local + axes * point};
  const Matrix3d gradient = gradient_at(planet, metres_from(planet, centre, partition.sector_size()));
  // The sum of m d (G d)^T, whose antisymmetric part is that of m d x (G d).
  const Matrix3d turning = axes * burden.second * axes.transpose() * gradient;
  const Vector3d torque(turning(1, 2) - turning(2, 1), turning(2, 0) - turning(0, 2),
                        turning(0, 1) - turning(1, 0));
  return {gradient * (axes * burden.first) * partition.dt(), torque * partition.dt()};
}

Ballast weighed(const Burden& burden) { return {burden.mass, burden.inertia.trace() / 2}; }

// Adds what a tick has made of what is aboard.
void owe(const Partition& partition, const FrameStep& step, const FrameBurden& all, CarriedFrame& carried) {
  const auto& [from, to, origin_change, axes, spin_change] = step;
  const Burden was = about(all.before, *all.centre);
  const Burden is = about(all.after, *all.centre);
  const Relative earlier = relative(was, from);
  const Relative later = relative(is, to);
  // Around a planet, as free flights have it.
  const Vector3d pull =
      (pull_at(partition, from, *all.centre) + pull_at(partition, to, *all.centre)) / 2 * partition.dt() -
      origin_change;
  const Vector3d change = velocity_at(to, *all.centre) - velocity_at(from, *all.centre) - pull;
  carried.owed += earlier.linear - later.linear + (carried.ballast.mass - is.mass) * change;
  carried.owed_spin += earlier.angular - later.angular + carried.ballast.inertia * (axes * spin_change) -
                       Vector3d(to.orientation * is.first).cross(change);
  // What the tide does, the carrier has not done.
  if (const auto* planet = std::get_if<CentralGravity>(&partition.settings.gravity)) {
    const Relative before = tide(partition, *planet, from, *all.centre, was);
    const Relative after = tide(partition, *planet, to, *all.centre, is);
    carried.owed += (before.linear + after.linear) / 2;
    carried.owed_spin += (before.angular + after.angular) / 2;
  }
}

// A tick pays half of what is owed, since what floats aboard answers a tick late, and the rest if it is
// little: with all of it, what is far from the centre of a lighter carrier would swing up.
// Along axes that `axes` turns to those of the ledger.
Wrench paid(CarriedFrame& carried, const Eigen::Quaterniond& axes, double dt) {
  static constexpr double kShare = 0.5;
  static constexpr double kLittle = 1e-9;  // m/s, rad/s
  const auto pay = [](Vector3d& owed, double little, double most) {
    Vector3d share = owed.norm() <= little ? owed : Vector3d(owed * kShare);
    if (const double size = share.norm(); size > most) share *= most / size;
    owed -= share;
    return share;
  };
  const Eigen::Quaterniond back = axes.conjugate();
  const Vector3d force =
      back * Vector3d(pay(carried.owed, kLittle * carried.ballast.mass, kForceMax * dt) / dt);
  const Vector3d torque =
      back * Vector3d(pay(carried.owed_spin, kLittle * carried.ballast.inertia, kTorqueMax * dt) / dt);
  return {{force.x(), force.y(), force.z()}, {torque.x(), torque.y(), torque.z()}};
}

// A body that carries a frame in this one counts with what is aboard that. `has_carriers`: there may be such.
BurdenSums sums_of(const Partition& partition, const Sector& sector, bool has_carriers) {
  BurdenSums sums;
  const Vector3d middle =
      metres_between({0, 0, 0, sector.index.frame}, sector.index, partition.sector_size());
  for (const HomeBody* body : sector.homes) {
    if (body->properties.motion != Motion::kDynamic) continue;
    const BodyState state = sector.world->state(body->slot);
    Ballast ballast;
    if (has_carriers) ballast = ballast_of(partition, body->id).value_or(Ballast{});
    const double mass = body->properties.mass + ballast.mass;
    const Vector3d place = middle + Vector3d(state.position.data());
    const Vector3d momentum = mass * Vector3d(state.linear_velocity.data());
    const Matrix3d axes = quaternion_of(state).toRotationMatrix();
    const Vector3d moments = Vector3d(body->properties.inertia.data()) + Vector3d::Constant(ballast.inertia);
    const Matrix3d inertia = axes * moments.asDiagonal() * axes.transpose();
    sums.mass.add(mass);
    add(mass * place, sums.first);
    add(mass * place * place.transpose(), sums.second);
    add(inertia, sums.inertia);
    add(momentum, sums.momentum);
    add(place.cross(momentum) + inertia * Vector3d(state.angular_velocity.data()), sums.spin);
    sums.awake += state.activity == Activity::kAsleep ? 0 : 1;
  }
  return sums;
}

}  // namespace

BurdenSums burden_of(const Partition& partition, FrameNumber frame) {
  // What rests here weighs what it has weighed, but for carriers, aboard which something may come or go.
  const bool has_carriers = std::ranges::any_of(partition.carried, [&](const CarriedFrame& carried) {
    return partition.settings.frames[carried.frame - 1].parent() == frame;
  });
  BurdenSums sums;
  for (const auto& [index, sector] : partition.sectors) {
    if (index.frame != frame || !sector->world) continue;
    if (sector->active || has_carriers) {
      sums += sums_of(partition, *sector, has_carriers);
      continue;
    }
    if (!sector->resting) sector->resting = sums_of(partition, *sector, has_carriers);
    sums += *sector->resting;
  }
  return sums;
}

void load_carriers(Partition& partition) {
  for (const CarriedFrame& carried : partition.carried) {
    const auto body = partition.bodies.find(partition.settings.frames[carried.frame - 1].carrier->body);
    if (body != partition.bodies.end()) load_ballast(partition, *body->second);
  }
}

std::vector<FrameBurden> begin_burdens(const Partition& partition) {
  std::vector<FrameBurden> burdens;
  for (const CarriedFrame& carried : partition.carried) {
    FrameBurden& burden = burdens.emplace_back();
    burden.frame = carried.frame;
    if (carried.is_borne) burden.before = burden_of(partition, carried.frame);
  }
  return burdens;
}

void end_burdens(const Partition& partition, std::vector<FrameBurden>& burdens) {
  for (std::size_t n = 0; n < burdens.size(); ++n) {
    FrameBurden& burden = burdens[n];
    if (partition.carried[n].is_borne) burden.after = burden_of(partition, burden.frame);
    const FrameCarrier& carrier = *partition.settings.frames[burden.frame - 1].carrier;
    const auto body = partition.bodies.find(carrier.body);
    if (body == partition.bodies.end() || body->second->properties.motion != Motion::kDynamic) continue;
    burden.centre = (carrier.pose.inverse() * centre_frame(body->second->properties)).position;
  }
}

std::vector<Command> bear_burdens(Partition& partition, Tick tick, const std::vector<CarriedFrame>& before,
                                  const std::vector<ProgramActs>& acts) {
  std::vector<Command> pushes;
  for (std::size_t n = 0; n < partition.carried.size(); ++n) {
    CarriedFrame& carried = partition.carried[n];
    FrameBurden all;
    for (const ProgramActs& some : acts) {
      for (const FrameBurden& burden : some.burdens) {
        if (burden.frame != carried.frame) continue;
        all.before += burden.before;
        all.after += burden.after;
        if (burden.centre) all.centre = burden.centre;
      }
    }
    if (!std::exchange(carried.is_borne, all.centre.has_value()) || !all.centre) {
      carried.ballast = {};
      continue;
    }
    const absl::StatusOr<FrameStep> step = step_of(partition, tick, before, before[n], carried);
    if (!step.ok()) continue;
    // At rest in a frame that turns, or on a planet, it is pushed by what holds it.
    const bool is_still = carried.place == before[n].place && carried.place.velocity.isZero(0);
    const bool rested = is_still && all.before.awake == 0 && all.after.awake == 0;
    if (!rested) owe(partition, *step, all, carried);
    carried.ballast = weighed(about(all.after, *all.centre));
    if (is_still && all.after.awake == 0) continue;
    const Wrench wrench = paid(carried, step->axes, partition.dt());
    // What rests aboard lets its carrier rest.
    const BodyId carrier = partition.settings.frames[carried.frame - 1].carrier->body;
    if (wrench == Wrench{}) continue;
    if (all.after.awake > 0) {
      pushes.push_back(ApplyForce{carrier, wrench});
    } else {
      pushes.push_back(PushBody{carrier, wrench});
    }
  }
  return pushes;
}

}  // namespace tessera
