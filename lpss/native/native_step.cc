// The second half of a step, and free flight.
#include "lpss/engine/still_clock.h"
#include "lpss/native/native_world.h"

namespace tessera::native {
// The same bits as in the solver for a body that nothing pushes.
void NativeWorld::fly(BodySlot slot, double dt) {
  Body& flier = body(slot);
  flier.flies = true;
  if (flier.turning) return fly_turning(flier, dt);
  if (!flier.flies_fine) return flier.coast(Scalar(dt));
  flier.angular += flier.angular_push(Scalar(dt));
  if (!flier.fine) flier.fine = flier.rounded();
  const Eigen::Vector3d push = (flier.exact_gravity + flier.other_pull()) * dt;
  flier.fine->velocity += push;
  flier.fine->position -= push * (dt / 2);
  flier.linear = flier.fine->velocity.cast<Scalar>();
  flier.coasts = true;
}

// To where its way leads, at the velocity at its end.
void NativeWorld::fly_turning(Body& flier, double dt) {
  const FrameTurn& turning = *flier.turning;
  flier.angular += flier.angular_push(Scalar(dt));
  const Eigen::Vector3d others = flier.other_pull();
  const Eigen::Vector3d change = turning.change + others * dt;
  const Eigen::Vector3d way = turning.way + others * (dt * dt / 2);
  if (!flier.flies_fine) {
    flier.linear += change.cast<Scalar>();
    flier.pose.position += way.cast<Scalar>() - flier.linear * Scalar(dt);
    return;
  }
  if (!flier.fine) flier.fine = flier.rounded();
  flier.fine->velocity += change;
  flier.fine->position += way - flier.fine->velocity * dt;
  flier.linear = flier.fine->velocity.cast<Scalar>();
  flier.coasts = true;
}

void NativeWorld::end_flight(BodySlot slot, const Eigen::Vector3d& acceleration, double dt) {
  Body& flier = body(slot);
  flier.flies = false;
  if (!flier.feels_gravity) return;
  const Eigen::Vector3d more = (acceleration - flier.exact_gravity) * (dt / 2);
  if (!flier.fine) {
    flier.linear += more.cast<Scalar>();
    return;
  }
  flier.fine->velocity += more;
  flier.linear = flier.fine->velocity.cast<Scalar>();
}

std::vector<StoppedBody> NativeWorld::integrate(double dt, const ParallelFor& parallel) {
  const Pieces pieces = pieces_of_bodies();
  run_parallel(parallel, pieces.count(), [&](std::size_t piece) {
    BodiesPiece& notes = bodies_pieces_[piece];
    notes.fast.clear();
    notes.foreseen.clear();
    notes.stopped.clear();
    for (std::size_t n = pieces.begin(piece); n < pieces.end(piece); ++n) {
      const auto slot = static_cast<BodySlot>(n);
      if (!moves_on(bodies_[n])) continue;
      if (const std::optional<DivergenceKind> kind = find_next(bodies_[n], dt)) {
        bodies_[n].stop();
        notes.stopped.push_back({slot, *kind});
      } else {
        if (!bodies_[n].jointed && is_swept(bodies_[n])) notes.fast.push_back(slot);
        if (is_looked_after(bodies_[n], Scalar(dt))) notes.foreseen.push_back(slot);
      }
    }
  });
  stop_at_obstacles(noted(&BodiesPiece::fast, pieces), Scalar(dt), parallel);
  stop_turning(noted(&BodiesPiece::foreseen, pieces), parallel);
  run_parallel(parallel, pieces.count(), [&](std::size_t piece) {
    for (std::size_t n = pieces.begin(piece); n < pieces.end(piece); ++n) move_on(bodies_[n], dt);
  });
  bounds_are_old_ = true;
  std::vector<StoppedBody> stopped;
  for (std::size_t piece = 0; piece < pieces.count(); ++piece) {
    const std::vector<StoppedBody>& some = bodies_pieces_[piece].stopped;
    stopped.insert(stopped.end(), some.begin(), some.end());
  }
  return stopped;
}

bool NativeWorld::moves_on(const Body& body) {
  return body.leaf && body.is_dynamic() && body.role == Role::kHome && body.is_awake();
}

// Where the body goes, unless it has diverged.
std::optional<DivergenceKind> NativeWorld::find_next(Body& body, double dt) {
  if (const std::optional<DivergenceKind> kind = body.divergence()) return kind;
  body.foresee(Scalar(dt));
  if (!body.coasts) {
    body.fine.reset();
  } else {
    body.fine->position += body.fine->velocity * dt;
    body.next.position = body.fine->position.cast<Scalar>();
    body.coasts = false;
  }
  if (!body.next.is_somewhere()) return DivergenceKind::kPosition;
  return std::nullopt;
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
  bounds_are_old_ = true;  // the solver has corrected poses
  refresh_bounds(parallel);
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
      // What nothing can push takes it along for the rest of its own way.
      if (const Body& other = body(hits[n]->other); !other.is_dynamic())
        swept.next.position += way_in_tick(other) * (1 - hits[n]->fraction);
      swept.fine.reset();
      swept.flies = false;
      is_stopped = true;
    }
  }
}

void NativeWorld::move_on(Body& body, double dt) const {
  if (!body.leaf || !body.is_dynamic()) return;
  body.force.setZero();
  body.torque.setZero();
  body.surge = 0;
  if (!moves_on(body)) return;
  body.pose = body.next;
  body.angular = body.next_angular;
  keep_still_clock(body, dt);
  body.start = body.pose.position;
  body.start_rotation = body.pose.rotation;
}

void NativeWorld::keep_still_clock(Body& kept, double dt) const {
  const StillClock<Scalar> clock =
      still_clock<Scalar>(kept.still_for, kept.linear.squaredNorm(), kept.angular.squaredNorm(),
                          kept.still_limits, settings_.sleep_after, dt);
  kept.still_for = clock.still_for;
  kept.activity = clock.wants_sleep ? Activity::kWantsSleep : Activity::kAwake;
}

}  // namespace tessera::native
