// What is foreseen of bodies that turn far, that joints hold, or that forces and drives accelerate within a
// tick: the solver has a row for what they may meet before they touch it.
#include <algorithm>

#include "lpss/native/native_world.h"

namespace tessera::native {
namespace {

constexpr std::size_t kForeseenInPiece = 8;

// Of half the thinnest extent, the way in a tick from which a body is foreseen that joints or forces move:
// its way may be another one than its velocity says.
constexpr Scalar kForeseenShare = Scalar(0.5);

// Of its way in a tick: what would be stopped earlier is deep already, and is not held where it is.
constexpr Scalar kStoppedMin = Scalar(0.1);

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
const Contact* NativeWorld::contact_of(BodySlot a, BodySlot b) const {
  const Candidate wanted{body(a).id, body(b).id};
  const auto place =
      std::lower_bound(candidates_.begin(), candidates_.end(), wanted,
                       [](const Candidate& x, const Candidate& y) { return x.key() < y.key(); });
  if (place == candidates_.end() || place->key() != wanted.key() || place->contact == Candidate::kNone)
    return nullptr;
  return &contacts_[static_cast<std::size_t>(place->contact)];
}

void NativeWorld::find_meetings(BodySlot slot, MeetingsPiece& piece) const {
  const Body& foreseen = body(slot);
  piece.near.clear();
  broad_phase_.for_each_in(foreseen.box, [&](BodySlot other_slot) {
    const Body& other = body(other_slot);
    if (other_slot == slot || !foreseen.box.overlaps(other.box)) return;
    // It finds the pair, unless it sleeps: then it says what it was.
    if (other.is_awake() && other.is_foreseen && other.id < foreseen.id) return;
    if (!is_wanted(foreseen, other)) return;
    piece.near.push_back(other_slot);
  });
  const auto dt = Scalar(settings_.time_step);
  for (const BodySlot other : piece.near) {
    const bool is_a = foreseen.id < body(other).id;
    Meeting meeting{is_a ? slot : other, is_a ? other : slot, {}};
    const bool is_more = contact_of(meeting.a, meeting.b) != nullptr;
    // What touches and is at rest has the rows that it needs, whatever pushes it.
    if (is_more && !is_foreseen_by_velocity(body(meeting.a), dt) &&
        !is_foreseen_by_velocity(body(meeting.b), dt))
      continue;
    const bool is_found = is_more ? piece.search.find_more(body(meeting.a), body(meeting.b), dt, meeting)
                                  : piece.search.find(body(meeting.a), body(meeting.b), dt, meeting);
    if (is_found) piece.meetings.push_back(std::move(meeting));
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
  Box box = turning.box_at(course.at(0));
  box.extend(turning.box_at(course.at(1)));
  box = box.grown(turning.solid->swing());
  piece.near.clear();
  broad_phase_.for_each_in(box, [&](BodySlot other_slot) {
    const Body& other = body(other_slot);
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
