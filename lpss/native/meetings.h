// Where two bodies that move and turn come near each other within a tick.
//
// Both are followed along their courses with their real shapes, by steps in which no two points can get from
// farther apart to within reach (conservative advancement: Mirtich, Impulse-based Dynamic Simulation of Rigid
// Body Systems, 1996). What is within reach at the start, as drives and forces make it, is found there.
#pragma once

#include <optional>

#include "lpss/native/body.h"
#include "lpss/native/contact.h"
#include "lpss/native/narrow_phase.h"

namespace tessera::native {

// How a body moves within a tick.
class Course {
 public:
  // By its velocities at the start of the tick.
  Course(const Body& body, Scalar dt);

  // Likewise, of what turns on the spot, whatever joints hold it: a wheel.
  static Course straight(const Body& body, Scalar dt);

  // As the solver has found, from before it pushed the body. For what no joint holds.
  static Course solved(const Body& body, Scalar dt);

  // After a share of the tick.
  Frame at(Scalar share) const;

  // Likewise, but for what changes nothing of the surface: where a point of a wheel is that does not roll
  // with it.
  Frame surface_at(Scalar share) const { return at(share, swing_); }

  bool stands() const { return stands_; }
  Scalar swing() const { return swing_.norm(); }  // rad, in the tick

  // m, by which no two points of two bodies come nearer to each other in the tick.
  friend Scalar approach_max(const Course& a, const Course& b) {
    return (a.way_ - b.way_).norm() + a.bend_ + b.bend_;
  }

  // m, the way of a point in the tick, as its velocity at the start says; `arm` from the centre.
  Vector way(const Vector& arm) const { return way_ + turn_.cross(arm); }

 private:
  void bend(Scalar radius);
  Frame at(Scalar share, const Vector& by) const;

  Frame start_;
  Vector way_ = Vector::Zero();    // m, of the centre
  Vector turn_ = Vector::Zero();   // rad
  Vector swing_ = Vector::Zero();  // rad, of that what moves the surface to where it was not
  // rad, by which the velocity turns: what joints hold turns about them, and a hinge on what stands keeps to
  // an arc. But a wheel turns on the spot.
  Vector arc_ = Vector::Zero();
  bool stands_ = true;
  Scalar bend_ = 0;  // m, that no point gets beside the way of the centre
};

// The points of two bodies where they come within reach, as patches for the solver. Levers are those there,
// and gaps what the velocities at the start close until then: in a tick in which bodies move like that, they
// are stopped there, however far they turn.
struct Meeting {
  BodySlot a = kNoSlot;  // the lower id
  BodySlot b = kNoSlot;
  absl::InlinedVector<ContactPatch, 1> patches;
};

// For one thread at a time.
class MeetingSearch {
 public:
  // Of a pair (a.id < b.id) of which at least one can be pushed, in a tick of `dt` seconds: after which share
  // of the tick they meet, if they do, and what is `seen` there. More than 1 where they would not yet, but
  // are accelerated.
  std::optional<Scalar> find(const Body& a, const Body& b, Scalar dt, Contact& seen);

  // Of a pair that has a contact: what else of the two may come near in the tick, as `seen` at its start.
  // What touches may turn them about it.
  void find_more(const Body& a, const Body& b, Scalar dt, Contact& seen);

  // What the two are going to touch within `ahead` of a tick from that share of it on, if they move straight.
  void look_there(const Body& a, const Body& b, Scalar dt, Scalar share, Scalar ahead, Contact& seen);

  // The patches of a meeting of what was seen after that share of the tick.
  void take(const Body& a, const Body& b, Scalar dt, Scalar share, const Contact& seen, Meeting& meeting);

  // The share of the tick after which a pair, as the solver has found it to move, is too deep in each other
  // to be pushed back; 1 if it never is, or is so from the start.
  Scalar share_until_deep(const Body& a, const Body& b, Scalar dt);

 private:
  void begin(const Body& a, const Body& b);
  void foresee(Scalar dt);
  Scalar look(Scalar share, Scalar margin);
  std::optional<Scalar> first_share(Scalar reach, Scalar until);
  Scalar before_overlap(Scalar apart, Scalar overlap, Scalar near);
  void take(const ContactPatch& from, Scalar share, ContactPatch& patch) const;
  bool take_there(ContactPoint& point, const Vector& normal, Scalar share) const;
  bool take_at(const Vector& arm_a, const Vector& arm_b, const Vector& normal, Scalar share,
               ContactPoint& point) const;
  bool take_from_start(ContactPoint& point, const Vector& normal) const;
  Scalar closes(const Vector& arm_a, const Vector& arm_b, const Vector& normal) const;

  // Of the pair.
  const Body* a_ = nullptr;
  const Body* b_ = nullptr;
  std::optional<Course> course_a_;
  std::optional<Course> course_b_;
  Scalar margin_ = 0;  // m, the distance at which contacts are found anyway
  Scalar reach_ = 0;   // m, with what forces and drives may add
  Scalar thin_ = 0;    // m, what they cannot pass through in a step
  Scalar approach_ = 0;
  Frame at_a_;  // of the last look
  Frame at_b_;
  Contact seen_;
  NarrowPhase narrow_phase_;
};

}  // namespace tessera::native
