// How an assembly is held where it will be at the end of a step, by Newton's method, and put right where it
// is not.

#include <algorithm>
#include <cmath>

#include "lpss/joints/joint_assembly.h"

namespace tessera::joints {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

// The share of an error that is corrected in a step.
constexpr double kPutRight = 0.3;

// m or rad: an error at the end of a step that is no error.
constexpr double kSettledError = 1e-10;

// rad, by which a body is turned at most to correct errors in a step.
constexpr double kTurnPutRight = 0.1;

// rad, in one step. Where a body turns farther, Newton's method would not find its arc.
constexpr double kTurnForeseen = 0.7;

constexpr int kHalvings = 6;    // of a step that goes too far
constexpr int kLooksAhead = 2;  // in a step
constexpr int kTilts = 3;       // of rotors, in a pass

// The share of its square by which what is turned back may change from one step of Newton's method to the
// next.
constexpr double kBentChange = 0.5;

}  // namespace

// Moves bodies by a share of Newton's step that leaves smaller errors: where little gives way along a row,
// the whole of it may go too far.
void JointAssembly::put_right() {
  if (errors_.lpNorm<Eigen::Infinity>() <= kSettled) return;
  VectorXd& whole = memory_.whole;
  held_.solve(errors_, memory_.impulses);
  held_.response(memory_.impulses, whole);
  whole *= -kPutRight;
  double turn = 0;
  for (Index first = 0; first < whole.size(); first += kBodyNumbers)
    turn = std::max(turn, whole.segment<3>(first + 3).norm());
  double share = turn > kTurnPutRight ? kTurnPutRight / turn : 1;
  VectorXd& way = memory_.way;
  VectorXd& left = memory_.held;
  for (int n = 0; n < kHalvings; ++n) {
    way = whole * share;
    const BodyTurns& turns = turns_in(way, 1);
    for (Tie& tie : ties_) tie.shifted = shifted(tie, way, turns.whole);
    find_errors([](const Tie& tie, Turns) -> const JointPoses& { return tie.shifted; }, left);
    if (weighed(left) <= weighed(errors_)) {
      for (Tie& tie : ties_) {
        tie.joint.posed.child.pose = tie.shifted.child;
        tie.joint.posed.parent.pose = tie.shifted.parent;
      }
      shift_bodies(way, turns.whole);
      errors_.swap(left);
      return;
    }
    share /= 2;
  }
}

// Both sides of a joint, where bodies that can be pushed are shifted and make these turns.
JointPoses JointAssembly::shifted(const Tie& tie, const VectorXd& way,
                                  std::span<const Eigen::Quaterniond> turns) const {
  const auto shift = [&](Pose& pose, Index body) {
    const Eigen::Quaterniond& turn = turns[static_cast<std::size_t>(body)];
    pose.position += way.segment<3>(kBodyNumbers * body);
    pose.orientation = (turn * pose.orientation).normalized();
  };
  JointPoses end{tie.joint.posed.parent.pose, tie.joint.posed.child.pose};
  shift(end.child, tie.child);
  if (tie.parent) shift(end.parent, *tie.parent);
  return end;
}

// Of what is m or rad, by what it takes to move it.
double JointAssembly::weighed(const VectorXd& errors) const {
  return errors.dot(errors.cwiseProduct(weights_));
}

void JointAssembly::hold(Motion& motion) {
  VectorXd& left = memory_.held;
  VectorXd& rates = memory_.rates;
  held_.rates(motion.velocities, rates);
  left = wanted_ + bent_ - rates;
  rates = bent_ - left / 2;  // on average, beyond the wanted ones
  if (is_soft_.size() > 0) left -= compliances_.cwiseProduct(motion.soft_impulses);
  VectorXd& impulses = memory_.impulses;
  held_.solve(left, impulses);
  motion.gained += hard_dot(impulses, rates);
  held_.response(impulses, memory_.whole);
  motion.velocities += memory_.whole;
  if (is_soft_.size() > 0) motion.soft_impulses += impulses.cwiseProduct(is_soft_);
}

// Of errors, none of soft rows.
VectorXd JointAssembly::without_soft(VectorXd held) const {
  if (is_soft_.size() > 0) held -= held.cwiseProduct(is_soft_);
  return held;
}

// Of errors, none of soft rows.
template <typename Numbers>
double JointAssembly::hard_dot(const VectorXd& held, const Numbers& other) const {
  if (is_soft_.size() > 0) return without_soft(held).dot(other);
  return held.dot(other);
}

// Of held rows, with the bodies of each joint where `poses_of` has them.
template <typename PosesOf>
void JointAssembly::find_errors(const PosesOf& poses_of, VectorXd& errors) const {
  errors.setZero(wanted_.size());
  Index n = 0;
  for (const Tie& tie : ties_) {
    find_held_errors(*tie.joint.form, tie.joint.posed, poses_of(tie, turns_for(tie)), errors.data() + n);
    n += tie.held;
  }
  const auto posed = [&](const Tie& tie) {
    const JointPoses poses = poses_of(tie, Turns::kWhole);
    PosedJoint end = tie.joint.posed;
    end.child.pose = poses.child;
    end.parent.pose = poses.parent;
    return end;
  };
  for (const Link& link : links_)
    errors[n++] = link.coupling.error(posed(ties_[link.follower]), posed(ties_[link.leader]));
}

// By how much errors will have grown once the bodies have moved, by the time: m/s or rad/s. Valid until the
// next call.
const VectorXd& JointAssembly::bend_after(const VectorXd& velocities) {
  VectorXd& bend = memory_.bend;
  const BodyTurns& turns = turns_in(velocities, span_);
  find_errors(
      [&](const Tie& tie, Turns which) { return poses_after(tie, velocities, span_, turns.of(which)); },
      bend);
  bend = (bend - errors_) / span_;
  return bend;
}

// Towards errors that do not grow.
void JointAssembly::hold_at_end(Motion& motion) {
  if (!is_held_) hold(motion);
  is_held_ = true;
  turn_as_pushed(motion.velocities);
  if (has_rotors_) tilt_rotors(motion);
  if (is_foreseen_ && !bend_back(motion)) look_ahead(motion);
}

// A rotor resists a tilt by a torque that what holds it takes up, which changes the tilt.
void JointAssembly::tilt_rotors(Motion& motion) {
  VectorXd& before = memory_.tilting;
  for (int n = 0;; ++n) {
    hold(motion);
    if (n == kTilts) return;
    before = motion.velocities;
    turn_as_pushed(motion.velocities);
    if ((motion.velocities - before).lpNorm<Eigen::Infinity>() * span_ <= kSettled) return;
  }
}

// One step of Newton's method with the rows as they are: what turns out of the held directions in a step is
// turned back at its end. False if that does not converge: where bodies turn far, and where a system is near
// to where it could not move at all.
bool JointAssembly::bend_back(Motion& motion) {
  if (turns_beyond(kTurnForeseen, motion.velocities, span_)) return false;
  const VectorXd& bend = bend_after(motion.velocities);
  if (bend.lpNorm<Eigen::Infinity>() * span_ <= kSettledError) return true;
  VectorXd& bent = memory_.bent;
  VectorXd& bending = memory_.bending;
  VectorXd& change = memory_.impulses;
  VectorXd& moved = memory_.whole;
  bent = bent_ - bend;
  held_.solve(bent, bending);
  change = bending - bending_;
  held_.response(change, moved);
  const bool is_settled = moved.lpNorm<Eigen::Infinity>() * span_ <= kSettled;
  if (!is_settled) {
    const double square = bent.dot(bending);
    if (!(square <= bent_energy_max(motion.velocities))) return false;
    if (is_bent_ && !((bent - bent_).dot(change) <= kBentChange * square)) return false;
  }
  is_bent_ = true;
  motion.gained += hard_dot(change, bent + bent_) / 2;
  motion.velocities += moved;
  if (is_soft_.size() > 0) motion.soft_impulses += change.cwiseProduct(is_soft_);
  bent_.swap(bent);
  bending_.swap(bending);
  return true;
}

// Steps of Newton's method with rows where the bodies will be: impulses along these take energy at most.
void JointAssembly::look_ahead(Motion& motion) {
  is_foreseen_ = false;
  bent_.setZero();
  hold(motion);
  VectorXd& velocities = motion.velocities;
  for (int n = 0; n < kLooksAhead; ++n) {
    make_held_rows_after(velocities);
    is_response_known_ = false;  // contacts that push as if joints held as before would put energy in
    if (!factorise()) return;
    const VectorXd off = bend_after(velocities);
    held_.rates(velocities, memory_.rates);
    bent_ = without_soft(memory_.rates - wanted_ - off);
    Motion held = motion;
    hold(held);
    const VectorXd change = held.velocities - velocities;
    const VectorXd& momenta = momenta_of(change);
    double share = -velocities.dot(momenta) / change.dot(momenta);
    if (!(share > 0)) break;
    share = std::min(share, 1.0);
    for (int k = 0; k < kHalvings; ++k) {
      if (!(weighed(bend_after(velocities + change * share)) > weighed(off))) break;
      share /= 2;
    }
    velocities += change * share;
    motion.soft_impulses += (held.soft_impulses - motion.soft_impulses) * share;
    motion.gained += share * (velocities.dot(momenta) - share / 2 * change.dot(momenta));
  }
  held_.rates(velocities, memory_.rates);
  bent_ = without_soft(memory_.rates - wanted_);
}

// Twice the energy (J) of what turns by the largest turn of a step: twice as far as joints turn it back.
double JointAssembly::bent_energy_max(const VectorXd& all_velocities) {
  const VectorXd& velocities = has_rotors_ ? without_spins(all_velocities) : all_velocities;
  const VectorXd& momenta = momenta_of(velocities);
  double energy = velocities.dot(momenta);
  double turn = 0;
  double mass = 0;
  Eigen::Vector3d momentum = Eigen::Vector3d::Zero();
  Index first = 0;
  for (const Body& body : bodies_) {
    momentum += momenta.segment<3>(first);
    mass += 1 / body.now.inverse_mass;
    turn = std::max(turn, velocities.segment<3>(first + 3).norm() * span_);
    first += kBodyNumbers;
  }
  if (!is_anchored_) energy -= momentum.squaredNorm() / mass;
  return energy * (turn * turn);
}

}  // namespace tessera::joints
