// The second half of a step, and free flight.
#include "lpss/bullet/still_clock.h"
#include "lpss/model/limits.h"
#include "lpss/native/native_world.h"

namespace tessera::native {
namespace {

// A body that has left the range in which numbers mean something is stopped where it was last known to be.
bool stop_runaway(Body& body) {
  const bool is_somewhere = body.pose.position.allFinite() && body.pose.rotation.allFinite();
  const bool is_slow =
      body.linear.cast<double>().squaredNorm() <= kSpeedMax * kSpeedMax && body.angular.allFinite();
  if (is_somewhere && is_slow) return false;
  if (!is_somewhere) body.pose = {Matrix::Identity(), (body.box.low + body.box.high) / 2};
  body.linear.setZero();
  body.angular.setZero();
  body.still_for = 0;
  body.fine.reset();
  if (body.flies_fine) body.fine = body.rounded();
  return true;
}

}  // namespace

// The same bits as in the solver for a body without rows.
void NativeWorld::fly(BodySlot slot, double dt) {
  Body& flier = body(slot);
  const auto step = Scalar(dt);
  flier.angular += flier.angular_push(step);
  if (!flier.flies_fine) {
    flier.linear += flier.linear_push(step);
    return;
  }
  if (!flier.fine) flier.fine = flier.rounded();
  flier.fine->velocity += (flier.force.cast<double>() * double(flier.inverse_mass)) * dt;
  flier.linear = flier.fine->velocity.cast<Scalar>();
  flier.coasts = true;
}

std::uint64_t NativeWorld::integrate(double dt) {
  const auto step = Scalar(dt);
  std::vector<BodySlot> fast;
  std::uint64_t stopped = 0;
  for (std::size_t n = 0; n < bodies_.size(); ++n) {
    Body& body = bodies_[n];
    if (!body.leaf || !body.is_dynamic() || body.role != Role::kHome || !body.is_awake()) continue;
    body.next = body.after(step);
    if (!body.coasts) {
      body.fine.reset();
    } else {
      body.fine->position += body.fine->velocity * dt;
      body.next.position = body.fine->position.cast<Scalar>();
      body.coasts = false;
    }
    const Vector way = body.next.position - body.pose.position;
    if (settings_.continuous_collision && body.swept_beyond > 0 && !body.jointed &&
        way.squaredNorm() > body.swept_beyond * body.swept_beyond) {
      fast.push_back(static_cast<BodySlot>(n));
    }
  }
  if (!fast.empty()) {
    boxes_are_old_ = true;  // the solver has corrected poses
    refresh_boxes();
  }
  for (const BodySlot slot : fast) {
    Body& swept = body(slot);
    if (const std::optional<SweepHit> hit = sweep(slot, swept.next.position)) {
      swept.next = swept.after(step * hit->fraction);
      swept.fine.reset();
    }
  }
  for (Body& body : bodies_) {
    if (!body.leaf || !body.is_dynamic()) continue;
    body.force.setZero();
    body.torque.setZero();
    if (body.role != Role::kHome || !body.is_awake()) continue;
    body.pose = body.next;
    keep_still_clock(body, dt);
    if (stop_runaway(body)) ++stopped;
  }
  boxes_are_old_ = true;
  return stopped;
}

void NativeWorld::keep_still_clock(Body& kept, double dt) const {
  const bullet::StillClock clock = bullet::still_clock(kept.still_for, kept.linear.squaredNorm(),
                                                       kept.angular.squaredNorm(), settings_, dt);
  kept.still_for = clock.still_for;
  kept.activity = clock.wants_sleep ? Activity::kWantsSleep : Activity::kAwake;
}

}  // namespace tessera::native
