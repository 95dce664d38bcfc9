// The second half of a step, and free flight.
#include "lpss/bullet/still_clock.h"
#include "lpss/model/limits.h"
#include "lpss/native/native_world.h"

namespace tessera::native {
namespace {

// A body that has left the range in which numbers mean something is stopped where it was last known to be.
bool stop_runaway(Body& body) {
  const bool is_somewhere = body.pose.is_somewhere();
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

// The same bits as in the solver for a body that nothing pushes.
void NativeWorld::fly(BodySlot slot, double dt) {
  Body& flier = body(slot);
  if (!flier.flies_fine) return flier.coast(Scalar(dt));
  flier.angular += flier.angular_push(Scalar(dt));
  if (!flier.fine) flier.fine = flier.rounded();
  flier.fine->velocity += (flier.force.cast<double>() * double(flier.inverse_mass)) * dt;
  flier.linear = flier.fine->velocity.cast<Scalar>();
  flier.coasts = true;
}

std::uint64_t NativeWorld::integrate(double dt, const ParallelFor& parallel) {
  const Pieces pieces = pieces_of_bodies();
  run_parallel(parallel, pieces.count(), [&](std::size_t piece) {
    std::vector<BodySlot>& fast = bodies_pieces_[piece].fast;
    fast.clear();
    for (std::size_t n = pieces.begin(piece); n < pieces.end(piece); ++n) {
      if (find_next(bodies_[n], dt)) fast.push_back(static_cast<BodySlot>(n));
    }
  });
  stop_at_obstacles(noted(&BodiesPiece::fast, pieces), Scalar(dt), parallel);
  run_parallel(parallel, pieces.count(), [&](std::size_t piece) {
    bodies_pieces_[piece].stopped = 0;
    for (std::size_t n = pieces.begin(piece); n < pieces.end(piece); ++n) {
      if (move_on(bodies_[n], dt)) ++bodies_pieces_[piece].stopped;
    }
  });
  boxes_are_old_ = true;
  std::uint64_t stopped = 0;
  for (std::size_t piece = 0; piece < pieces.count(); ++piece) stopped += bodies_pieces_[piece].stopped;
  return stopped;
}

// Where the body goes. True if the way is so long that it has to be swept.
bool NativeWorld::find_next(Body& body, double dt) const {
  if (!body.leaf || !body.is_dynamic() || body.role != Role::kHome || !body.is_awake()) return false;
  body.foresee(Scalar(dt));
  if (!body.coasts) {
    body.fine.reset();
  } else {
    body.fine->position += body.fine->velocity * dt;
    body.next.position = body.fine->position.cast<Scalar>();
    body.coasts = false;
  }
  return !body.jointed && is_swept(body);
}

// One that the solver has pushed far is squeezed, and may be deep in something.
bool NativeWorld::is_swept(const Body& body) const {
  constexpr Scalar kPushedShare = Scalar(0.2);
  if (!settings_.continuous_collision || body.swept_beyond <= 0) return false;
  const Scalar way = (body.next.position - body.start).squaredNorm();
  const Scalar push = (body.pose.position - body.start).squaredNorm();
  const Scalar most = body.swept_beyond * body.swept_beyond;
  return way > most || push > most * (kPushedShare * kPushedShare);
}

void NativeWorld::stop_at_obstacles(std::span<const BodySlot> fast, Scalar dt, const ParallelFor& parallel) {
  if (fast.empty()) return;
  boxes_are_old_ = true;  // the solver has corrected poses
  refresh_boxes();
  // Where a clone goes is known to its own sector alone. What is stopped may be in the way of others: these
  // are swept again.
  constexpr int kRoundsMax = 8;
  constexpr Scalar kSame = Scalar(0.99);  // of its way: it has been stopped here before
  std::vector<std::optional<SweepHit>> hits(fast.size());
  std::vector<Scalar> shares(fast.size(), Scalar(1));  // of their ways
  bool is_stopped = true;
  for (int round = 0; round < kRoundsMax && is_stopped; ++round) {
    run_parallel(parallel, fast.size(),
                 [&](std::size_t n) { hits[n] = sweep(fast[n], /*without_clones=*/true); });
    is_stopped = false;
    for (std::size_t n = 0; n < fast.size(); ++n) {
      if (!hits[n] || (shares[n] < 1 && hits[n]->fraction > kSame)) continue;
      Body& swept = body(fast[n]);
      const Vector way = swept.next.position - swept.start;
      if (way.isZero(0)) continue;
      shares[n] *= hits[n]->fraction;
      swept.foresee(dt * shares[n]);
      swept.next.position = swept.start + way * hits[n]->fraction;
      swept.fine.reset();
      is_stopped = true;
    }
  }
}

// True if the body had to be stopped.
bool NativeWorld::move_on(Body& body, double dt) const {
  if (!body.leaf || !body.is_dynamic()) return false;
  body.force.setZero();
  body.torque.setZero();
  if (body.role != Role::kHome || !body.is_awake()) return false;
  body.pose = body.next;
  body.angular = body.next_angular;
  keep_still_clock(body, dt);
  const bool is_stopped = stop_runaway(body);
  body.start = body.pose.position;
  return is_stopped;
}

void NativeWorld::keep_still_clock(Body& kept, double dt) const {
  const bullet::StillClock clock =
      bullet::still_clock(kept.still_for, kept.linear.squaredNorm(), kept.angular.squaredNorm(),
                          kept.still_limits, settings_.sleep_after, dt);
  kept.still_for = clock.still_for;
  kept.activity = clock.wants_sleep ? Activity::kWantsSleep : Activity::kAwake;
}

}  // namespace tessera::native
