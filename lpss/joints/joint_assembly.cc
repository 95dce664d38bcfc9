#include "lpss/joints/joint_assembly.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <utility>

#include "lpss/base/disjoint_sets.h"
#include "lpss/base/rotation.h"

namespace tessera::joints {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

// By this share of what holds it, a row gives way, so that rows which imply one another have a solution. In a
// loop they do so nearly, and up to the rounding of poses: were rows to give way by less than that, errors
// that nothing can correct would move what is free.
constexpr double kTreeGivesWay = 1e-9;
constexpr double kLoopGivesWay = 1e-7;

// The share of an error that is corrected in a step.
constexpr double kPutRight = 0.3;

// m or rad, of the way of a step: what changes by less is settled.
constexpr double kSettled = 1e-8;

// m or rad: an error at the end of a step that is no error.
constexpr double kSettledError = 1e-10;

// With so many axes that may have rows of their own, an assembly has its rows anew in each step; with more
// only if it turns far, since each of these is a vector over all bodies.
constexpr std::ptrdiff_t kAxesAnewMax = 500;

// A row of which less is left by what is held than so many times what rows give way by is held itself: what
// moves then is a mechanism that jams, as far as its rows give way.
constexpr double kFree = 10;

// rad, in one tick. What turns farther moves step by step.
constexpr double kTurnWhole = 0.25;

// rad, by which a body is turned at most to correct errors in a step.
constexpr double kTurnPutRight = 0.1;

// rad, in one step. Where a body turns farther, Newton's method would not find its arc.
constexpr double kTurnForeseen = 0.7;

constexpr int kHalvings = 6;    // of a step that goes too far
constexpr int kLooksAhead = 2;  // in a step

// The share of its square by which what is turned back may change from one step of Newton's method to the
// next.
constexpr double kBentChange = 0.5;

// An assembly has diverged if held rows have made more than this share of its energy of motion in one tick,
// and more than so much: J/kg.
constexpr double kGainedMax = 0.5;
constexpr double kGainedMin = 0.01;

// m/s or rad/s: beyond all that a body survives (divergence_of()), and far within the range of numbers.
constexpr double kBeyondSpeed = 1e15;

}  // namespace

Eigen::Vector3d SharedVector::get() const {
  if (single_ != nullptr) return Eigen::Map<const Eigen::Vector3f>(single_).cast<double>();
  return Eigen::Map<const Eigen::Vector3d>(double_);
}

void SharedVector::set(const Eigen::Vector3d& value) const {
  for (Index i = 0; i < 3; ++i) {
    if (single_ != nullptr) {
      single_[i] = static_cast<float>(value[i]);
    } else {
      double_[i] = value[i];
    }
  }
}

JointAssembly::JointAssembly(std::vector<SolvedJoint> joints, std::span<const JointedBody> bodies, double dt,
                             int steps, KnownPatterns& patterns)
    : steps_(steps), span_(dt), patterns_(patterns) {
  ties_.reserve(joints.size());
  std::map<int, Index> places;
  const auto place_of = [&](int body) {
    const auto [place, is_new] = places.emplace(body, static_cast<Index>(bodies_.size()));
    if (is_new) {
      bodies_.push_back({bodies[static_cast<std::size_t>(body)],
                         {body, Eigen::Vector3d::Zero(), Eigen::Quaterniond::Identity(), false}});
    }
    return place->second;
  };
  for (SolvedJoint& joint : joints) {
    Tie& tie = ties_.emplace_back();
    tie.child = place_of(joint.child);
    if (joint.parent) tie.parent = place_of(*joint.parent);
    tie.joint = std::move(joint);
  }
  add_links();
  make_nodes();
  is_anchored_ = std::ranges::any_of(ties_, [](const Tie& tie) { return !tie.parent; });
  gives_way_ = has_loop() ? kLoopGivesWay : kTreeGivesWay;
  velocities_ = VectorXd(kBodyNumbers * static_cast<Index>(bodies_.size()));
  Index first = 0;
  for (const Body& body : bodies_) {
    velocities_.segment<3>(first) = body.now.linear;
    velocities_.segment<3>(first + 3) = body.now.angular;
    first += kBodyNumbers;
  }
  moves_ = steps > 1 && axes_with_rows() <= kAxesAnewMax;
  if (moves_) {
    span_ /= steps;
  } else {
    make_rows();
  }
}

bool JointAssembly::has_loop() const {
  const std::size_t world = bodies_.size();
  DisjointSets sets(world + 1);
  for (const Tie& tie : ties_) {
    const auto child = static_cast<std::size_t>(tie.child);
    const std::size_t parent = tie.parent ? static_cast<std::size_t>(*tie.parent) : world;
    if (sets.find(child) == sets.find(parent)) return true;
    sets.unite(child, parent);
  }
  return false;
}

// Limits, drives and friction.
std::ptrdiff_t JointAssembly::axes_with_rows() const {
  std::ptrdiff_t count = 0;
  for (const Tie& tie : ties_) {
    const std::span<const JointAxis> axes = axes_of(*tie.joint.properties);
    for (std::size_t n = 0; n < axes.size(); ++n) {
      const bool is_limited = axes[n].lower > -kUnbounded || axes[n].upper < kUnbounded;
      const bool is_driven = (*tie.joint.drives)[n].mode != DriveMode::kFree;
      if (is_limited || is_driven || axes[n].friction > 0) ++count;
    }
  }
  return count;
}

// A large one as the velocities are now: a whip cracks within a tick.
void JointAssembly::find_whether_to_move() {
  if (moves_ || steps_ == 1) return;
  Motion held{velocities_, soft_impulses_};
  hold(held);
  if (!turns_beyond(kTurnWhole, velocities_, span_) && !turns_beyond(kTurnWhole, held.velocities, span_)) {
    return;
  }
  moves_ = true;
  span_ /= steps_;
}

bool JointAssembly::turns_beyond(double turn, const VectorXd& velocities, double time) const {
  for (Index first = 0; first < velocities.size(); first += kBodyNumbers) {
    if (!(velocities.segment<3>(first + 3).norm() * time <= turn)) return true;
  }
  return false;
}

// Moves bodies by a share of Newton's step that leaves smaller errors: where little gives way along a row,
// the whole of it may go too far.
void JointAssembly::put_right() {
  const VectorXd whole = -kPutRight * held_.response(held_.solve(errors_));
  double turn = 0;
  for (Index first = 0; first < whole.size(); first += kBodyNumbers)
    turn = std::max(turn, whole.segment<3>(first + 3).norm());
  double share = turn > kTurnPutRight ? kTurnPutRight / turn : 1;
  for (int n = 0; n < kHalvings; ++n) {
    const VectorXd way = whole * share;
    VectorXd left = errors_of([&](const Tie& tie) { return shifted(tie, way); });
    if (weighed(left) <= weighed(errors_)) {
      for (Tie& tie : ties_) tie.joint.posed = shifted(tie, way);
      shift_bodies(way);
      errors_ = std::move(left);
      return;
    }
    share /= 2;
  }
}

// Both sides of a joint, where bodies that can be pushed are shifted.
PosedJoint JointAssembly::shifted(const Tie& tie, const VectorXd& way) const {
  const auto shift = [&](Pose& pose, Index body) {
    pose =
        moved({pose, way.segment<3>(kBodyNumbers * body), way.segment<3>(kBodyNumbers * body + 3)}, 1).pose;
  };
  PosedJoint end = tie.joint.posed;
  shift(end.child.pose, tie.child);
  if (tie.parent) shift(end.parent.pose, *tie.parent);
  return end;
}

// Of what is m or rad, by what it takes to move it.
double JointAssembly::weighed(const VectorXd& errors) const {
  return errors.dot(errors.cwiseProduct(weights_));
}

// False where the rows have no solution: the assembly has diverged.
bool JointAssembly::factorise() {
  fill_held();
  std::vector<Inertia> inertia;
  inertia.reserve(bodies_.size());
  for (const Body& body : bodies_) inertia.push_back({body.now.inverse_mass, body.now.inverse_inertia});
  has_diverged_ = !held_.factorise(inertia, gives_way_, compliances_, patterns_);
  if (has_diverged_) return false;
  weights_ = held_.diagonal().cwiseInverse();
  add_free_rows();
  return true;
}

// Of what is held, that are in a row.
VectorXd JointAssembly::shares_of(const VectorXd& row) const {
  const VectorXd whole = held_.answers(row);
  VectorXd shares = held_.solve(whole);
  VectorXd left = whole - held_.answers(held_.row(shares));
  if (is_soft_.size() > 0) left -= compliances_.cwiseProduct(shares);
  shares += held_.solve(left);
  return shares;
}

// Takes out of each row what is held, in the metric of the inverse masses. Rows that are made anew go on from
// the impulses of the step before.
void JointAssembly::add_free_rows() {
  const std::vector<FreeRow> before = std::exchange(free_rows_, {});
  const double parts = moves_ ? 1 : steps_;
  for (const Tie& tie : ties_) {
    for (const JointRow& row : tie.rows) {
      if (row.is_held) continue;
      FreeRow free;
      free.row = over_bodies(tie, row);
      const double whole = free.row.dot(answer_to(free.row));
      free.shares = shares_of(free.row);
      if (is_soft_.size() > 0) {
        free.soft_shares = free.shares.cwiseProduct(is_soft_);
        free.shares -= free.soft_shares;
      }
      free.row -= held_.row(free.shares);
      free.response = answer_to(free.row);
      if (is_soft_.size() > 0) free.response -= held_.response(free.soft_shares);
      free.mobility = free.row.dot(free.response);
      if (!(free.mobility > kFree * gives_way_ * whole)) continue;
      const double return_max = kReturnSpeed * std::sqrt(std::min(free.mobility / whole, 1.0));
      free.velocity = row.velocity + std::clamp(row.return_velocity, -return_max, return_max);
      free.compliance = row.compliance * parts;
      free.impulse_min = row.impulse_min / parts;
      free.impulse_max = row.impulse_max / parts;
      free_rows_.push_back(std::move(free));
    }
  }
  if (before.size() != free_rows_.size()) return;
  for (std::size_t i = 0; i < before.size(); ++i) {
    FreeRow& free = free_rows_[i];
    free.impulse = std::clamp(before[i].impulse, free.impulse_min, free.impulse_max);
  }
}

// True if others have changed a velocity.
bool JointAssembly::see_changes() {
  bool is_changed = false;
  Index first = 0;
  const auto see = [&](const SharedVector& shared, Eigen::Vector3d& seen, Index place) {
    const Eigen::Vector3d change = shared.get();
    if (change == seen) return;
    const Eigen::Vector3d push = change - seen;
    velocities_.segment<3>(place) += push;
    seen = change;
    is_changed = true;
  };
  for (Body& body : bodies_) {
    see(body.now.linear_change, body.linear_seen, first);
    see(body.now.angular_change, body.angular_seen, first + 3);
    first += kBodyNumbers;
  }
  if (is_changed) is_held_ = false;
  return is_changed;
}

// Velocities out of all range are not told to others, which contacts would push to wherever these go.
void JointAssembly::set_motion(const Motion& motion) {
  const VectorXd& velocities = motion.velocities;
  has_diverged_ =
      has_diverged_ || !velocities.allFinite() || velocities.lpNorm<Eigen::Infinity>() > kBeyondSpeed;
  if (has_diverged_) return;
  velocities_ = velocities;
  soft_impulses_ = motion.soft_impulses;
  gained_ += motion.gained;
  Index first = 0;
  for (Body& body : bodies_) {
    const JointedBody& now = body.now;
    now.linear_change.set(velocities.segment<3>(first) - now.linear);
    now.angular_change.set(velocities.segment<3>(first + 3) - now.angular);
    body.linear_seen = now.linear_change.get();
    body.angular_seen = now.angular_change.get();
    first += kBodyNumbers;
  }
}

void JointAssembly::start_step() {
  if (has_diverged_) return;
  is_settled_ = false;
  is_held_ = false;
  see_changes();
  soft_impulses_.setZero();
  find_whether_to_move();
  if (moves_) {
    advance();
    make_rows();
  }
  if (has_diverged_ || free_rows_.empty()) return;
  Motion moved{velocities_, soft_impulses_};
  for (const FreeRow& free : free_rows_) push(moved, free, free.impulse);
  set_motion(moved);
}

void JointAssembly::hold(Motion& motion) const {
  VectorXd left = wanted_ + bent_ - held_.rates(motion.velocities);
  const VectorXd rates = bent_ - left / 2;  // on average, beyond the wanted ones
  if (is_soft_.size() > 0) left -= compliances_.cwiseProduct(motion.soft_impulses);
  const VectorXd impulses = held_.solve(left);
  motion.gained += without_soft(impulses).dot(rates);
  motion.velocities += held_.response(impulses);
  if (is_soft_.size() > 0) motion.soft_impulses += impulses.cwiseProduct(is_soft_);
}

void JointAssembly::push(Motion& motion, const FreeRow& free, double impulse) const {
  motion.velocities += free.response * impulse;
  if (is_soft_.size() > 0) motion.soft_impulses -= free.soft_shares * impulse;
}

// Of errors, none of soft rows.
VectorXd JointAssembly::without_soft(VectorXd held) const {
  if (is_soft_.size() > 0) held -= held.cwiseProduct(is_soft_);
  return held;
}

// Of each body, after a time at these velocities.
std::vector<Eigen::Quaterniond> JointAssembly::turns(const VectorXd& velocities, double time) const {
  std::vector<Eigen::Quaterniond> turns;
  turns.reserve(bodies_.size());
  for (Index first = 0; first < velocities.size(); first += kBodyNumbers)
    turns.push_back(rotation_by(velocities.segment<3>(first + 3) * time));
  return turns;
}

// Both sides of a joint after a time at these velocities, in which bodies make these turns.
PosedJoint JointAssembly::after(const Tie& tie, const VectorXd& velocities, double time,
                                std::span<const Eigen::Quaterniond> turns) const {
  const auto moved_by = [&](JointSide side, Index body) {
    side.linear_velocity = velocities.segment<3>(kBodyNumbers * body);
    side.angular_velocity = velocities.segment<3>(kBodyNumbers * body + 3);
    side.pose.position += side.linear_velocity * time;
    side.pose.orientation = (turns[static_cast<std::size_t>(body)] * side.pose.orientation).normalized();
    return side;
  };
  PosedJoint end = tie.joint.posed;
  end.child = moved_by(end.child, tie.child);
  end.parent = tie.parent ? moved_by(end.parent, *tie.parent) : joints::moved(end.parent, time);
  return end;
}

// Of held rows, with each joint where `posed` has it.
template <typename Posed>
VectorXd JointAssembly::errors_of(const Posed& posed) const {
  VectorXd errors = VectorXd::Zero(wanted_.size());
  std::vector<JointRow> rows;
  Index n = 0;
  for (const Tie& tie : ties_) {
    rows.clear();
    append_held_rows(*tie.joint.properties, posed(tie), rows);
    Index next = n;
    for (const JointRow& row : rows) errors[next++] = row.error;
    n += std::ranges::count(tie.rows, true, &JointRow::is_held);
  }
  for (const Link& link : links_)
    errors[n++] = link.coupling.error(posed(ties_[link.follower]), posed(ties_[link.leader]));
  return errors;
}

// By how much errors will have grown once the bodies have moved, by the time.
VectorXd JointAssembly::bend(const VectorXd& velocities) const {
  const std::vector<Eigen::Quaterniond> turned = turns(velocities, span_);
  const VectorXd end = errors_of([&](const Tie& tie) { return after(tie, velocities, span_, turned); });
  return (end - errors_) / span_;
}

// Towards errors that do not grow.
void JointAssembly::hold_at_end(Motion& motion) {
  if (!is_held_) hold(motion);
  is_held_ = true;
  if (is_foreseen_ && !bend_back(motion)) look_ahead(motion);
}

// One step of Newton's method with the rows as they are: what turns out of the held directions in a step is
// turned back at its end. False if that does not converge: where bodies turn far, and where a system is near
// to where it could not move at all.
bool JointAssembly::bend_back(Motion& motion) {
  if (turns_beyond(kTurnForeseen, motion.velocities, span_)) return false;
  const VectorXd off = bend(motion.velocities);
  if (off.lpNorm<Eigen::Infinity>() * span_ <= kSettledError) return true;
  VectorXd bent = bent_ - off;
  VectorXd bending = held_.solve(bent);
  const VectorXd change = bending - bending_;
  const double square = bent.dot(bending);
  const double changed = (bent - bent_).dot(change);
  const VectorXd moved = held_.response(change);
  const bool is_settled = moved.lpNorm<Eigen::Infinity>() * span_ <= kSettled;
  if (!is_settled && !(square <= bent_energy_max(motion.velocities))) return false;
  if (!is_settled && is_bent_ && !(changed <= kBentChange * square)) return false;
  is_bent_ = true;
  motion.gained += without_soft(change).dot(bent + bent_) / 2;
  motion.velocities += moved;
  if (is_soft_.size() > 0) motion.soft_impulses += change.cwiseProduct(is_soft_);
  bent_ = std::move(bent);
  bending_ = std::move(bending);
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
    if (!factorise()) return;
    const VectorXd off = bend(velocities);
    bent_ = without_soft(held_.rates(velocities) - wanted_ - off);
    Motion held = motion;
    hold(held);
    const VectorXd change = held.velocities - velocities;
    const VectorXd momenta = momenta_of(change);
    double share = -velocities.dot(momenta) / change.dot(momenta);
    if (!(share > 0)) break;
    share = std::min(share, 1.0);
    for (int k = 0; k < kHalvings && weighed(bend(velocities + change * share)) > weighed(off); ++k)
      share /= 2;
    velocities += change * share;
    motion.soft_impulses += (held.soft_impulses - motion.soft_impulses) * share;
    motion.gained += share * (velocities.dot(momenta) - share / 2 * change.dot(momenta));
  }
  bent_ = without_soft(held_.rates(velocities) - wanted_);
}

VectorXd JointAssembly::momenta_of(const VectorXd& velocities) const {
  VectorXd momenta(velocities.size());
  Index first = 0;
  for (const Body& body : bodies_) {
    momenta.segment<3>(first) = velocities.segment<3>(first) / body.now.inverse_mass;
    momenta.segment<3>(first + 3) = body.now.inverse_inertia.inverse() * velocities.segment<3>(first + 3);
    first += kBodyNumbers;
  }
  return momenta;
}

// Twice the energy (J) of what turns by the largest turn of a step: twice as far as joints turn it back.
double JointAssembly::bent_energy_max(const VectorXd& velocities) const {
  const VectorXd momenta = momenta_of(velocities);
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

void JointAssembly::pass() {
  if (has_diverged_ || (!see_changes() && is_settled_)) return;
  Motion moved{velocities_, soft_impulses_};
  hold_at_end(moved);
  if (has_diverged_) return;
  const VectorXd wanted = wanted_ + bent_;
  for (FreeRow& free : free_rows_) {
    const double missing = free.velocity - free.shares.dot(wanted) - free.row.dot(moved.velocities) -
                           free.compliance * free.impulse;
    const double impulse = std::clamp(free.impulse + missing / (free.mobility + free.compliance),
                                      free.impulse_min, free.impulse_max);
    push(moved, free, impulse - free.impulse);
    free.impulse = impulse;
  }
  is_settled_ = (moved.velocities - velocities_).lpNorm<Eigen::Infinity>() * span_ <= kSettled;
  set_motion(moved);
}

void JointAssembly::move() {
  if (has_diverged_) return;
  see_changes();
  ways_.push_back(velocities_);
}

// To where move() has found the bodies to come in the steps before.
void JointAssembly::advance() {
  for (const VectorXd& velocities : ways_) {
    const std::vector<Eigen::Quaterniond> turned = turns(velocities, span_);
    for (Tie& tie : ties_) tie.joint.posed = after(tie, velocities, span_, turned);
    shift_bodies(velocities * span_);
  }
  ways_.clear();
}

void JointAssembly::shift_bodies(const VectorXd& way) {
  Index first = 0;
  for (Body& body : bodies_) {
    const Eigen::Quaterniond turn = rotation_by(way.segment<3>(first + 3));
    const Eigen::Matrix3d axes = turn.toRotationMatrix();
    body.now.inverse_inertia = axes * body.now.inverse_inertia * axes.transpose();
    body.moved.way += way.segment<3>(first);
    body.moved.turn = (turn * body.moved.turn).normalized();
    first += kBodyNumbers;
  }
}

// Held rows put no energy in, but for what the length of a step makes of turns: in mechanisms that hold, up
// to a tenth of what moves.
bool JointAssembly::gains_energy() const {
  double mass = 0;
  for (const Body& body : bodies_) mass += 1 / body.now.inverse_mass;
  if (!(gained_ > kGainedMin * mass)) return false;
  const double kinetic = velocities_.dot(momenta_of(velocities_)) / 2;
  return !(gained_ <= kGainedMax * kinetic);
}

void JointAssembly::end(std::vector<BodyMotion>& moved) {
  has_diverged_ = has_diverged_ || gains_energy();
  if (moves_ && !has_diverged_) advance();
  for (Body& body : bodies_) {
    body.moved.is_whole = moves_;
    if (has_diverged_) body.moved.way.setConstant(std::numeric_limits<double>::quiet_NaN());
    moved.push_back(body.moved);
  }
}

}  // namespace tessera::joints
