// What is foreseen of bodies that turn far, that joints hold, or that forces and drives accelerate within a
// tick: the solver has a row for what they may meet before they touch it.
#include <algorithm>
#include <cmath>
#include <utility>

#include "lpss/native/native_world.h"

namespace tessera::native {
namespace {

constexpr std::size_t kForeseenInPiece = 8;

// Of half the thinnest extent, the way in a tick from which a body is foreseen that joints or forces move:
// its way may be another one than its velocity says.
constexpr Scalar kForeseenShare = Scalar(0.5);

// Of its way in a tick: what would be stopped earlier is deep already, and is not held where it is.
constexpr Scalar kStoppedMin = Scalar(0.1);

// How often a body is looked at within a tick behind what it passes.
constexpr Scalar kLooksMax = 8;

}  // namespace

bool NativeWorld::is_foreseen(const Body& body, Scalar dt) const {
  if (!settings_.continuous_collision || body.swept_beyond <= 0) return false;
  if (!body.jointed && body.surge == 0) return swings_far(body, dt);
  return body.linear.norm() * dt + body.swing(dt) + body.surge > kForeseenShare * body.swept_beyond;
}

bool NativeWorld::is_foreseen_by_velocity(const Body& body, Scalar dt) {
  return body.linear.norm() * dt + body.swing(dt) > kForeseenShare * body.swept_beyond;
}

bool NativeWorld::swings_far(const Body& body, Scalar dt) {
  const Scalar radius = body.solid->swing() * dt;  // of most bodies, this tells
  const Scalar most = body.swept_beyond * body.swept_beyond;
  return body.angular.squaredNorm() * (radius * radius) > most && body.swing(dt) > body.swept_beyond;
}

// The contact of two bodies, a.id < b.id, if they have one.
Contact* NativeWorld::contact_of(BodySlot a, BodySlot b) {
  const Candidate wanted{body(a).id, body(b).id};
  const auto place =
      std::lower_bound(candidates_.begin(), candidates_.end(), wanted,
                       [](const Candidate& x, const Candidate& y) { return x.key() < y.key(); });
  if (place == candidates_.end() || place->key() != wanted.key() || place->contact == Candidate::kNone)
    return nullptr;
  return &contacts_[static_cast<std::size_t>(place->contact)];
}

void NativeWorld::find_meetings(BodySlot slot, MeetingsPiece& piece) {
  look_ahead(slot, piece);
  join_ahead(slot, piece);
  look_on(slot, piece);
  for (const Ahead& ahead : piece.ahead) {
    const bool is_a = body(slot).id < body(ahead.other).id;
    Meeting meeting{is_a ? slot : ahead.other, is_a ? ahead.other : slot, {}};
    piece.search.take(body(meeting.a), body(meeting.b), Scalar(settings_.time_step), ahead.share, ahead.seen,
                      meeting);
    if (!meeting.patches.empty()) piece.meetings.push_back(std::move(meeting));
  }
}

// What the body is going to touch, ascending by ids.
void NativeWorld::look_ahead(BodySlot slot, MeetingsPiece& piece) {
  const Body& foreseen = body(slot);
  piece.near.clear();
  piece.ahead.clear();
  broad_phase_.for_each_in(foreseen.bounds, [&](BodySlot other_slot) {
    const Body& other = body(other_slot);
    if (other_slot == slot || !foreseen.bounds.overlaps(other.bounds)) return;
    // It finds the pair, unless it sleeps: then it says what it was.
    if (other.is_awake() && other.is_foreseen && other.id < foreseen.id) return;
    if (!is_wanted(foreseen, other)) return;
    piece.near.push_back(other_slot);
  });
  std::ranges::sort(piece.near, {}, [&](BodySlot near) { return body(near).id; });
  const auto dt = Scalar(settings_.time_step);
  const Course course(foreseen, dt);
  for (const BodySlot other : piece.near) {
    const bool is_a = foreseen.id < body(other).id;
    const Body& a = is_a ? foreseen : body(other);
    const Body& b = is_a ? body(other) : foreseen;
    std::optional<Scalar> share = 0;
    if (!contact_of(is_a ? slot : other, is_a ? other : slot)) {
      share = piece.search.find(a, b, dt, piece.seen);
    } else if (is_foreseen_by_velocity(a, dt) || is_foreseen_by_velocity(b, dt)) {
      piece.search.find_more(a, b, dt, piece.seen);
    } else {
      continue;  // what touches and is at rest has the rows that it needs, whatever pushes it
    }
    if (share && !piece.seen.patches.empty())
      piece.ahead.push_back({other, *share, piece.seen, course.at(*share)});
  }
}

// Of all that stands still, the body does not meet what does not stand out from what bears it.
void NativeWorld::join_ahead(BodySlot slot, MeetingsPiece& piece) {
  const auto dt = Scalar(settings_.time_step);
  const Body& foreseen = body(slot);
  if (!foreseen.is_dynamic()) return;
  const auto is_fixed = [&](BodySlot other) {
    return !body(other).is_dynamic() && Course(body(other), dt).stands();
  };
  piece.contacts.clear();
  piece.fixed.clear();
  for (Ahead& ahead : piece.ahead) {
    if (is_fixed(ahead.other)) piece.fixed.push_back({&foreseen, &body(ahead.other), &ahead.seen, ahead.at});
  }
  if (piece.fixed.empty()) return;
  for (const BodySlot other : piece.near) {
    const bool is_a = foreseen.id < body(other).id;
    Contact* const contact = contact_of(is_a ? slot : other, is_a ? other : slot);
    if (contact && is_fixed(other)) piece.contacts.push_back({&foreseen, &body(other), contact});
  }
  for (Ahead& ahead : piece.ahead) ahead.patches = ahead.seen.patches.size();
  piece.flush.join(piece.contacts, piece.fixed, dt);
  for (Ahead& ahead : piece.ahead) ahead.is_passed = ahead.seen.patches.size() < ahead.patches;
}

// Behind what is flush with what bears it, the body may meet what is not: a ramp, of which only the foot is
// as low as the floor. The first of it that is not flush is what it meets.
void NativeWorld::look_on(BodySlot slot, MeetingsPiece& piece) {
  const auto dt = Scalar(settings_.time_step);
  const Body& foreseen = body(slot);
  const Course course = Course::straight(foreseen, dt);
  const Scalar looks =
      std::clamp(std::ceil(foreseen.linear.norm() * dt / foreseen.solid->margin()), Scalar(1), kLooksMax);
  const std::size_t first = piece.ahead.size();
  for (std::size_t n = 0; n < first; ++n) {
    const auto [other, from] = std::pair(piece.ahead[n].other, piece.ahead[n].share);
    if (!piece.ahead[n].is_passed) continue;
    const bool is_a = foreseen.id < body(other).id;
    for (Scalar look = 1; look <= looks; ++look) {
      const Scalar share = look / looks;
      if (share <= from) continue;
      piece.search.look_there(is_a ? foreseen : body(other), is_a ? body(other) : foreseen, dt, share,
                              1 / looks, piece.seen);
      if (!piece.seen.patches.empty()) piece.ahead.push_back({other, share, piece.seen, course.at(share)});
    }
  }
  if (piece.ahead.size() == first) return;
  join_ahead(slot, piece);
  const Ahead* last = nullptr;
  for (Ahead& ahead : std::span(piece.ahead).subspan(first)) {
    if (ahead.seen.patches.empty()) continue;
    if (last && last->other == ahead.other) {
      ahead.seen.patches.clear();
    } else {
      last = &ahead;
    }
  }
}

void NativeWorld::for_each_piece_of(std::span<const BodySlot> foreseen, const ParallelFor& parallel,
                                    absl::FunctionRef<void(MeetingsPiece&, std::size_t)> act) {
  const Pieces pieces(foreseen.size(), kForeseenInPiece);
  if (meetings_pieces_.size() < pieces.count()) meetings_pieces_.resize(pieces.count());
  run_parallel(parallel, pieces.count(), [&](std::size_t n) {
    MeetingsPiece& piece = meetings_pieces_[n];
    piece.meetings.clear();
    piece.stopped.clear();
    for (std::size_t place = pieces.begin(n); place < pieces.end(n); ++place) act(piece, place);
  });
}

// Contacts from where bodies are going to be.
void NativeWorld::predict_meetings(std::span<const BodySlot> foreseen, const ParallelFor& parallel) {
  if (foreseen.empty()) return;
  for_each_piece_of(foreseen, parallel,
                    [&](MeetingsPiece& piece, std::size_t n) { find_meetings(foreseen[n], piece); });
  const Pieces pieces(foreseen.size(), kForeseenInPiece);
  for (const MeetingsPiece& piece : std::span(meetings_pieces_).first(pieces.count())) {
    for (const Meeting& meeting : piece.meetings) {
      Candidate& candidate = candidate_of(meeting.a, meeting.b);
      if (candidate.contact == Candidate::kNone)
        candidate.contact = keep_contact(blank_contact(body(meeting.a), body(meeting.b)));
      Contact& contact = contacts_[static_cast<std::size_t>(candidate.contact)];
      contact.patches.insert(contact.patches.end(), meeting.patches.begin(), meeting.patches.end());
    }
  }
}

// Whether the body, which the solver has moved, may have been turned into something. Joints would tear if it
// were stopped alone.
bool NativeWorld::is_looked_after(const Body& body, Scalar dt) const {
  if (!settings_.continuous_collision || body.jointed || body.swept_beyond <= 0) return false;
  if (body.is_foreseen || swings_far(body, dt)) return true;
  // The solver may have turned it, and stopped it.
  const Scalar chord = (body.next.rotation - body.start_rotation).norm();
  return chord * body.solid->swing() > 2 * body.swept_beyond && body.solid->round_axis().isZero(0);
}

Scalar NativeWorld::share_until_deep(BodySlot slot, MeetingsPiece& piece) const {
  const Body& turning = body(slot);
  const auto dt = Scalar(settings_.time_step);
  const Course course = Course::solved(turning, dt);
  Bounds bounds = turning.bounds_at(course.at(0));
  bounds.extend(turning.bounds_at(course.at(1)));
  bounds = bounds.grown(turning.solid->swing());
  piece.near.clear();
  broad_phase_.for_each_in(bounds, [&](BodySlot other_slot) {
    const Body& other = body(other_slot);
    // The boxes that are searched depend on what the body did before.
    if (!bounds.overlaps(other.bounds)) return;
    // Where a clone goes is known to its own sector alone.
    if (other_slot == slot || (other.role == Role::kClone && other.is_dynamic())) return;
    if (is_wanted(turning, other)) piece.near.push_back(other_slot);
  });
  Scalar least = 1;
  for (const BodySlot other : piece.near) {
    const bool is_a = turning.id < body(other).id;
    least = std::min(least,
                     piece.search.share_until_deep(body(is_a ? slot : other), body(is_a ? other : slot), dt));
  }
  return least;
}

void NativeWorld::stop_turning(std::span<const BodySlot> turning, const ParallelFor& parallel) {
  if (turning.empty()) return;
  for_each_piece_of(turning, parallel, [&](MeetingsPiece& piece, std::size_t n) {
    const Scalar share = share_until_deep(turning[n], piece);
    if (share < 1 && share > kStoppedMin) piece.stopped.emplace_back(turning[n], share);
  });
  const Pieces pieces(turning.size(), kForeseenInPiece);
  for (const MeetingsPiece& piece : std::span(meetings_pieces_).first(pieces.count())) {
    for (const auto& [slot, share] : piece.stopped) {
      Body& stopped = body(slot);
      stopped.next = Course::solved(stopped, Scalar(settings_.time_step)).at(share);
      stopped.fine.reset();
    }
  }
}

}  // namespace tessera::native
