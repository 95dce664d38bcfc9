#include "lpss/native/meetings.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lpss/base/portable_math.h"
#include "lpss/base/rotation.h"

namespace tessera::native {
namespace {

// Steps are no shorter than this share of the thinner body: nothing passes in one. Very long courses are
// looked at in so many steps.
constexpr Scalar kStepShare = Scalar(0.25);
constexpr int kStepsMax = 1024;
// What turns so far in a tick (rad), and is accelerated, is followed on its arc as far as it may get: at most
// this share of the tick beyond it.
constexpr Scalar kSwingsFar = Scalar(0.1);
constexpr Scalar kBeyondMax = 1;
// Of the reach: what is found this much too early is near enough.
constexpr Scalar kEarly = Scalar(0.25);
// m, the least reach, also of what has no margin.
constexpr Scalar kReachMin = Scalar(1e-4);
constexpr int kHalvings = 12;
// Of the thinnest extent of both.
constexpr Scalar kPassedShare = Scalar(0.2);
// m, how far points are also looked for that what touches may turn in.
constexpr Scalar kAlsoMax = 1;

constexpr Scalar kAnyDistance = std::numeric_limits<Scalar>::max();

}  // namespace

Course::Course(const Body& body, Scalar dt) : start_(body.pose) {
  if (body.motion == Motion::kStatic || !body.is_awake()) return;
  way_ = body.linear * dt;
  turn_ = body.angular * dt;
  const bool is_ball = body.solid->swing() == 0;
  const Vector axis = body.pose.rotation * body.solid->round_axis();
  if (!is_ball) swing_ = turn_ - axis * axis.dot(turn_);
  if (body.jointed && body.is_dynamic()) arc_ = is_ball ? turn_ : swing_;
  bend(body.solid->radius());
}

Course Course::straight(const Body& body, Scalar dt) {
  Course course(body, dt);
  course.arc_.setZero();
  course.bend(body.solid->radius());
  return course;
}

Course Course::solved(const Body& body, Scalar dt) {
  Course course(body, dt);
  if (!body.is_dynamic() || !body.is_awake()) return course;
  course.start_ = {body.start_rotation, body.start};
  course.way_ = body.next.position - body.start;
  const Eigen::Matrix3d turn = (body.next.rotation * body.start_rotation.transpose()).cast<double>();
  course.turn_ = rotation_vector(Eigen::Quaterniond(turn).normalized()).cast<Scalar>();
  course.swing_ = course.turn_;
  course.arc_.setZero();
  course.bend(body.solid->radius());
  return course;
}

void Course::bend(Scalar radius) {
  stands_ = way_.isZero(0) && turn_.isZero(0);
  bend_ = turn_.norm() * radius + arc_.norm() * way_.norm();
}

Frame Course::at(Scalar share) const { return at(share, turn_); }

Frame Course::at(Scalar share, const Vector& by) const {
  if (stands_ || share == 0) return start_;
  Frame at{turned(start_.rotation, by * share), start_.position};
  const Scalar turn = arc_.norm();
  if (turn == 0) {
    at.position += way_ * share;
    return at;
  }
  const Vector axis = arc_ / turn;
  const Vector along = axis * axis.dot(way_);
  const portable::SinCos arc = portable::sincos(double(turn) * double(share));
  const Scalar versine = Scalar((1 - arc.cos) / double(turn));
  at.position += along * share + (way_ - along) * Scalar(arc.sin / double(turn)) + axis.cross(way_) * versine;
  return at;
}

void MeetingSearch::begin(const Body& a, const Body& b) {
  a_ = &a;
  b_ = &b;
  margin_ = std::max(std::min(a.solid->margin(), b.solid->margin()), kReachMin);
  reach_ = margin_ + a.surge + b.surge;
  thin_ = kAnyDistance;
  for (const Body* body : {&a, &b}) {
    if (body->is_dynamic()) thin_ = std::min(thin_, body->swept_beyond);
  }
  thin_ = std::max(thin_, margin_);
}

void MeetingSearch::foresee(Scalar dt) {
  course_a_.emplace(*a_, dt);
  course_b_.emplace(*b_, dt);
  approach_ = approach_max(*course_a_, *course_b_);
}

std::optional<Scalar> MeetingSearch::find(const Body& a, const Body& b, Scalar dt, Contact& seen) {
  begin(a, b);
  foresee(dt);
  const Scalar surge = a.surge + b.surge;
  std::optional<Scalar> share;
  if (surge > 0 && std::max(course_a_->swing(), course_b_->swing()) > kSwingsFar)
    share = first_share(margin_, 1 + std::min(surge / approach_, kBeyondMax));
  if (!share) share = first_share(reach_, 1);
  if (!share) return std::nullopt;
  // The one that touches may turn the others in.
  look(*share, reach_ * (1 + kEarly) + std::min(approach_, kAlsoMax));
  std::swap(seen.patches, seen_.patches);
  return share;
}

void MeetingSearch::find_more(const Body& a, const Body& b, Scalar dt, Contact& seen) {
  begin(a, b);
  foresee(dt);
  look(0, reach_ + std::min(approach_, kAlsoMax));
  std::swap(seen.patches, seen_.patches);
  for (ContactPatch& patch : seen.patches) {
    std::uint8_t more = 0;
    for (std::uint8_t n = 0; n < patch.count; ++n) {
      if (patch.point[n].gap > margin_) patch.point[more++] = patch.point[n];
    }
    patch.count = more;
  }
  const auto is_empty = [](const ContactPatch& patch) { return patch.count == 0; };
  seen.patches.erase(std::remove_if(seen.patches.begin(), seen.patches.end(), is_empty), seen.patches.end());
}

void MeetingSearch::look_there(const Body& a, const Body& b, Scalar dt, Scalar share, Scalar ahead,
                               Contact& seen) {
  begin(a, b);
  course_a_ = Course::straight(a, dt);
  course_b_ = Course::straight(b, dt);
  approach_ = approach_max(*course_a_, *course_b_);
  look(share, approach_ * ahead);
  std::swap(seen.patches, seen_.patches);
}

void MeetingSearch::take(const Body& a, const Body& b, Scalar dt, Scalar share, const Contact& seen,
                         Meeting& meeting) {
  begin(a, b);
  foresee(dt);
  at_a_ = course_a_->at(share);
  at_b_ = course_b_->at(share);
  meeting.patches.clear();
  for (const ContactPatch& from : seen.patches) {
    ContactPatch patch;
    take(from, share, patch);
    if (patch.count > 0) meeting.patches.push_back(patch);
  }
}

Scalar MeetingSearch::share_until_deep(const Body& a, const Body& b, Scalar dt) {
  begin(a, b);
  course_a_ = Course::solved(a, dt);
  course_b_ = Course::solved(b, dt);
  approach_ = approach_max(*course_a_, *course_b_);
  Scalar extent = kAnyDistance;
  for (const Body* body : {&a, &b}) {
    if (body->solid->extent() > 0) extent = std::min(extent, body->solid->extent());
  }
  const Scalar deep = kPassedShare * extent;
  const Scalar step_min = std::max(kStepShare * deep / approach_, Scalar(1) / kStepsMax);
  Scalar share = 0;
  Scalar free = 0;
  while (true) {
    const Scalar left = approach_ * (1 - share);
    const Scalar looked = std::min(left, thin_);
    const Scalar gap = look(share, looked);
    if (gap < -deep) break;
    if (share >= 1 || (gap > looked && looked >= left)) return 1;
    free = share;
    share = std::min(share + std::max((std::min(gap, looked) + deep) / approach_, step_min), Scalar(1));
  }
  if (share == 0) return 1;
  for (int n = 0; n < kHalvings; ++n) {
    const Scalar middle = (free + share) / 2;
    (look(middle, 0) < -deep ? share : free) = middle;
  }
  return free;
}

// m, the least gap after a share of the tick, if it is within a margin.
Scalar MeetingSearch::look(Scalar share, Scalar margin) {
  at_a_ = course_a_->at(share);
  at_b_ = course_b_->at(share);
  const bool moves_a = share > 0 && !course_a_->stands();
  const bool moves_b = share > 0 && !course_b_->stands();
  if (moves_a && moves_b) {
    narrow_phase_.look(Body(*a_, at_a_), Body(*b_, at_b_), margin, seen_);
  } else if (moves_a) {
    narrow_phase_.look(Body(*a_, at_a_), *b_, margin, seen_);
  } else if (moves_b) {
    narrow_phase_.look(*a_, Body(*b_, at_b_), margin, seen_);
  } else {
    narrow_phase_.look(*a_, *b_, margin, seen_);
  }
  Scalar least = kAnyDistance;
  for (const ContactPatch& patch : seen_.patches) {
    for (int n = 0; n < patch.count; ++n) least = std::min(least, patch.point[n].gap);
  }
  return least;
}

// When the two first come within reach, until a share of the tick.
std::optional<Scalar> MeetingSearch::first_share(Scalar reach, Scalar until) {
  const Scalar near = reach * (1 + kEarly);
  const Scalar step_min = std::max(kStepShare * thin_ / approach_, Scalar(1) / kStepsMax);
  const Scalar ahead = std::max(thin_, reach);
  Scalar share = 0;
  Scalar apart = 0;
  while (true) {
    const Scalar left = approach_ * (until - share);
    const Scalar looked = std::min(left, ahead);
    const Scalar gap = look(share, near + looked);
    if (gap <= near) return gap < 0 && share > 0 ? before_overlap(apart, share, near) : share;
    // No point gets within reach before.
    const Scalar sure = gap > near + looked ? looked : gap - reach;
    if (sure >= left || share >= until) return std::nullopt;
    apart = share;
    share = std::min(share + std::max(sure / approach_, step_min), until);
  }
}

// A step that went too far is halved.
Scalar MeetingSearch::before_overlap(Scalar apart, Scalar overlap, Scalar near) {
  Scalar low = apart;
  Scalar high = overlap;
  for (int n = 0; n < kHalvings; ++n) {
    const Scalar middle = (low + high) / 2;
    const Scalar gap = look(middle, near);
    if (gap >= 0 && gap <= near) return middle;
    (gap < 0 ? high : low) = middle;
  }
  return high;
}

// The points of a patch, with the gaps that the velocities at the start close until they touch.
void MeetingSearch::take(const ContactPatch& from, Scalar share, ContactPatch& patch) const {
  patch.is_predicted = true;
  patch.parts = ~std::uint64_t{0};
  patch.normal = from.normal;
  for (int n = 0; n < from.count; ++n) {
    ContactPoint point = from.point[n];
    if (share > 0 ? !take_there(point, from.normal, share) : !take_from_start(point, from.normal)) continue;
    patch.point[patch.count++] = point;
  }
}

// m, that the velocities at the start close in a tick between two points, `arm_a` and `arm_b` from the
// centres.
Scalar MeetingSearch::closes(const Vector& arm_a, const Vector& arm_b, const Vector& normal) const {
  return -normal.dot(course_a_->way(arm_a) - course_b_->way(arm_b));
}

// A point at which the two are apart by a gap after a share of the tick. One that parts there has been closer
// before, and was no contact then: false.
bool MeetingSearch::take_there(ContactPoint& point, const Vector& normal, Scalar share) const {
  return take_at(course_a_->at(share).rotation * point.on_a, course_b_->at(share).rotation * point.on_b,
                 normal, share, point);
}

bool MeetingSearch::take_at(const Vector& arm_a, const Vector& arm_b, const Vector& normal, Scalar share,
                            ContactPoint& point) const {
  const Scalar gap = point.gap + closes(arm_a, arm_b, normal) * share;
  if (gap < 0 && point.gap >= 0) return false;
  point.on_a = a_->pose.rotation.transpose() * arm_a;
  point.on_b = b_->pose.rotation.transpose() * arm_b;
  point.gap = gap;
  return true;
}

// A point at the start that may touch later: there, if it does by its course. Otherwise it may approach by
// what is left of its gap where it is nearest, and by what its velocity says beyond its way, which bends.
bool MeetingSearch::take_from_start(ContactPoint& point, const Vector& normal) const {
  constexpr int kLooks = 8;
  const auto along = [&](const Course& course, const Vector& on, Scalar share) {
    return normal.dot(course.surface_at(share) * on - course.at(0) * on);
  };
  const auto change = [&](Scalar share) {
    return along(*course_a_, point.on_a, share) - along(*course_b_, point.on_b, share);
  };
  Scalar least = 0;
  for (int n = 1; n <= kLooks; ++n) {
    Scalar touches = Scalar(n) / kLooks;
    if (point.gap + change(touches) > 0) {
      least = std::min(least, change(touches));
      continue;
    }
    Scalar apart = Scalar(n - 1) / kLooks;
    for (int half = 0; half < kHalvings; ++half) {
      const Scalar middle = (apart + touches) / 2;
      (point.gap + change(middle) > 0 ? apart : touches) = middle;
    }
    point.gap = 0;
    return take_at(course_a_->surface_at(touches).rotation * point.on_a,
                   course_b_->surface_at(touches).rotation * point.on_b, normal, touches, point);
  }
  const Scalar bends = closes(at_a_.rotation * point.on_a, at_b_.rotation * point.on_b, normal) + least;
  point.gap += std::max(bends, Scalar(0));
  return true;
}

}  // namespace tessera::native
