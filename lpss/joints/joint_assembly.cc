#include "lpss/joints/joint_assembly.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "lpss/base/rotation.h"
#include "lpss/base/torque_free.h"
#include "lpss/model/divergence.h"

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

// rad, in one tick. What turns farther moves step by step.
constexpr double kTurnWhole = 0.25;

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

// An assembly has diverged if held rows have made more than this share of its energy of motion in one tick,
// and more than so much: J/kg.
constexpr double kGainedMax = 0.5;
constexpr double kGainedMin = 0.01;

// m/s or rad/s: beyond all that a body survives (divergence_of()), and far within the range of numbers.
constexpr double kBeyondSpeed = 1e15;

}  // namespace

void JointAssembly::clear() {
  ties_count_ = 0;
  bodies_.clear();
  touched_.clear();
}

void JointAssembly::add(const SolvedJoint& joint, std::span<const JointedBody> bodies,
                        std::span<Index> places) {
  const auto place_of = [&](int body) {
    Index& place = places[static_cast<std::size_t>(body)];
    if (place == kNoPlace) {
      place = static_cast<Index>(bodies_.size());
      bodies_.push_back({bodies[static_cast<std::size_t>(body)],
                         {body, Eigen::Vector3d::Zero(), Eigen::Quaterniond::Identity(), false, {}},
                         {}});
    }
    return place;
  };
  if (ties_count_ == ties_.size()) ties_.emplace_back();
  Tie& tie = ties_[ties_count_++];
  tie.child = place_of(joint.child);
  tie.parent.reset();
  if (joint.parent) tie.parent = place_of(*joint.parent);
  tie.joint = joint;
}

void JointAssembly::begin(double dt, int steps) {
  ties_.resize(ties_count_);
  steps_ = steps;
  span_ = dt;
  free_count_ = 0;
  gained_ = 0;
  is_settled_ = has_diverged_ = false;
  is_response_known_ = false;
  gives_.clear();
  ways_count_ = 0;
  add_links();
  make_nodes();
  is_anchored_ = std::ranges::any_of(ties_, [](const Tie& tie) { return !tie.parent; });
  find_rotors();
  gives_way_ = has_loop() ? kLoopGivesWay : kTreeGivesWay;
  velocities_.resize(kBodyNumbers * static_cast<Index>(bodies_.size()));
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

bool JointAssembly::has_loop() {
  const std::size_t world = bodies_.size();
  DisjointSets& sets = scratch_.sets;
  sets.reset(world + 1);
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
  Index first = 0;
  for (const Body& body : bodies_) {
    if (!(turning(body, velocities.segment<3>(first + 3)).norm() * time <= turn)) return true;
    first += kBodyNumbers;
  }
  return false;
}

// Moves bodies by a share of Newton's step that leaves smaller errors: where little gives way along a row,
// the whole of it may go too far.
void JointAssembly::put_right() {
  VectorXd& whole = scratch_.whole;
  held_.solve(errors_, scratch_.impulses);
  held_.response(scratch_.impulses, whole);
  whole *= -kPutRight;
  double turn = 0;
  for (Index first = 0; first < whole.size(); first += kBodyNumbers)
    turn = std::max(turn, whole.segment<3>(first + 3).norm());
  double share = turn > kTurnPutRight ? kTurnPutRight / turn : 1;
  VectorXd& way = scratch_.way;
  VectorXd& left = scratch_.held;
  for (int n = 0; n < kHalvings; ++n) {
    way = whole * share;
    find_turns(way, 1);
    for (Tie& tie : ties_) tie.shifted = shifted(tie, way);
    find_errors([](const Tie& tie, Turns) -> const JointPoses& { return tie.shifted; }, left);
    if (weighed(left) <= weighed(errors_)) {
      for (Tie& tie : ties_) {
        tie.joint.posed.child.pose = tie.shifted.child;
        tie.joint.posed.parent.pose = tie.shifted.parent;
      }
      shift_bodies(way);
      errors_.swap(left);
      return;
    }
    share /= 2;
  }
}

// Both sides of a joint, where bodies that can be pushed are shifted and make the turns of find_turns().
JointPoses JointAssembly::shifted(const Tie& tie, const VectorXd& way) const {
  const auto shift = [&](Pose& pose, Index body) {
    const Eigen::Quaterniond& turn = scratch_.turns[static_cast<std::size_t>(body)];
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

// False where the rows have no solution: the assembly has diverged.
bool JointAssembly::factorise() {
  fill_held();
  std::vector<Inertia>& inertia = scratch_.inertia;
  inertia.clear();
  for (const Body& body : bodies_) inertia.push_back({body.now.inverse_mass, body.now.inverse_inertia});
  has_diverged_ = !held_.factorise(inertia, gives_way_, compliances_, patterns_);
  if (has_diverged_) return false;
  weights_ = held_.diagonal().cwiseInverse();
  add_free_rows();
  return true;
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
  if (is_changed) {
    is_held_ = is_settled_ = false;
    is_pushed_ = true;
  }
  return is_changed;
}

// Velocities out of all range are not told to others, which contacts would push to wherever these go.
void JointAssembly::set_motion(const Motion& motion) {
  const VectorXd& velocities = motion.velocities;
  const auto is_bounded = [](double speed) { return std::abs(speed) <= kBeyondSpeed; };  // and a number
  has_diverged_ = has_diverged_ || !std::all_of(velocities.begin(), velocities.end(), is_bounded);
  if (has_diverged_) return;
  velocities_ = velocities;
  soft_impulses_ = motion.soft_impulses;
  gained_ += motion.gained;
  show_velocities();
}

void JointAssembly::show_velocities() {
  Index first = 0;
  for (Body& body : bodies_) {
    const JointedBody& now = body.now;
    now.linear_change.set(velocities_.segment<3>(first) - now.linear);
    now.angular_change.set(velocities_.segment<3>(first + 3) - now.angular);
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
  is_pushed_ = false;
  soft_impulses_.setZero();
  find_whether_to_move();
  if (moves_) {
    advance();
    make_rows();
  }
  if (has_diverged_) return;
  turn_freely();
  if (has_rotors_) show_velocities();
  if (free_count_ == 0) return;
  Motion& moved = begin_motion();
  for (const FreeRow& free : free_rows()) push(moved, free, free.impulse);
  set_motion(moved);
}

// What their inertia makes of the rates of bodies from one step to the next, were nothing to push them ...
void JointAssembly::turn_freely() {
  const double step = step_time();
  Index first = 0;
  for (Body& body : bodies_) {
    auto rate = velocities_.segment<3>(first + 3);
    const SteppedRate next = spins(body) ? next_rate_of_rotor(inertia_of(body), *body.spin_axis, rate, step)
                                         : next_rate(inertia_of(body), body.now.inverse_inertia, rate, step);
    rate = next.rate;
    body.beyond_middle = next.beyond_middle;
    first += kBodyNumbers;
  }
}

// ... and what it makes of these now that something has.
void JointAssembly::turn_as_pushed(VectorXd& velocities) {
  const double step = step_time();
  Index first = 0;
  for (Body& body : bodies_) {
    auto rate = velocities.segment<3>(first + 3);
    const Eigen::Vector3d beyond = momentum_beyond_middle(inertia_of(body), rate, turning(body, rate), step);
    rate += body.now.inverse_inertia * (beyond - body.beyond_middle);
    body.beyond_middle = beyond;
    first += kBodyNumbers;
  }
}

JointAssembly::Motion& JointAssembly::begin_motion() {
  scratch_.moved.velocities = velocities_;
  scratch_.moved.soft_impulses = soft_impulses_;
  scratch_.moved.gained = 0;
  return scratch_.moved;
}

void JointAssembly::hold(Motion& motion) {
  VectorXd& left = scratch_.held;
  VectorXd& rates = scratch_.rates;
  held_.rates(motion.velocities, rates);
  left = wanted_ + bent_ - rates;
  rates = bent_ - left / 2;  // on average, beyond the wanted ones
  if (is_soft_.size() > 0) left -= compliances_.cwiseProduct(motion.soft_impulses);
  VectorXd& impulses = scratch_.impulses;
  held_.solve(left, impulses);
  motion.gained += hard_dot(impulses, rates);
  held_.response(impulses, scratch_.whole);
  motion.velocities += scratch_.whole;
  if (is_soft_.size() > 0) motion.soft_impulses += impulses.cwiseProduct(is_soft_);
}

void JointAssembly::push(Motion& motion, const FreeRow& free, double impulse) const {
  const FreeDirection& direction = directions_[free.direction];
  motion.velocities += direction.response * impulse;
  if (is_soft_.size() > 0) motion.soft_impulses -= direction.soft_shares * impulse;
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

// Of each body, after a time at these velocities.
void JointAssembly::find_turns(const VectorXd& velocities, double time) {
  scratch_.turns.clear();
  for (Index first = 0; first < velocities.size(); first += kBodyNumbers)
    scratch_.turns.push_back(rotation_by(velocities.segment<3>(first + 3) * time));
  if (has_rotors_) find_turns_of_rotors(velocities, time);
}

// Both sides of a joint after a time at these velocities, in which bodies make the turns of find_turns().
JointPoses JointAssembly::poses_after(const Tie& tie, const VectorXd& velocities, double time,
                                      Turns of_rotors) const {
  const auto& turns = has_rotors_ && of_rotors == Turns::kTilts ? scratch_.tilts : scratch_.turns;
  const auto move = [&](Pose& pose, Index body) {
    pose.position += velocities.segment<3>(kBodyNumbers * body) * time;
    pose.orientation = (turns[static_cast<std::size_t>(body)] * pose.orientation).normalized();
  };
  const JointSide& parent = tie.joint.posed.parent;
  JointPoses end{parent.pose, tie.joint.posed.child.pose};
  move(end.child, tie.child);
  if (tie.parent) {
    move(end.parent, *tie.parent);
  } else {
    end.parent = moved(parent, time).pose;
  }
  return end;
}

PosedJoint JointAssembly::after(const Tie& tie, const VectorXd& velocities, double time, Turns turns) const {
  const auto set_velocity = [&](JointSide& side, Index body) {
    side.linear_velocity = velocities.segment<3>(kBodyNumbers * body);
    side.angular_velocity = velocities.segment<3>(kBodyNumbers * body + 3);
  };
  const JointPoses poses = poses_after(tie, velocities, time, turns);
  PosedJoint end = tie.joint.posed;
  end.child.pose = poses.child;
  end.parent.pose = poses.parent;
  set_velocity(end.child, tie.child);
  if (tie.parent) set_velocity(end.parent, *tie.parent);
  return end;
}

// Of held rows, with the bodies of each joint where `poses_of` has them.
template <typename PosesOf>
void JointAssembly::find_errors(const PosesOf& poses_of, VectorXd& errors) const {
  errors.setZero(wanted_.size());
  Index n = 0;
  for (const Tie& tie : ties_) {
    find_held_errors(*tie.joint.properties, tie.joint.posed, poses_of(tie, turns_for(tie)),
                     errors.data() + n);
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

// By how much errors will have grown once the bodies have moved, by the time.
void JointAssembly::find_bend(const VectorXd& velocities) {
  VectorXd& bend = scratch_.bend;
  find_turns(velocities, span_);
  find_errors([&](const Tie& tie, Turns turns) { return poses_after(tie, velocities, span_, turns); }, bend);
  bend = (bend - errors_) / span_;
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
  VectorXd& before = scratch_.tilting;
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
  find_bend(motion.velocities);
  if (scratch_.bend.lpNorm<Eigen::Infinity>() * span_ <= kSettledError) return true;
  VectorXd& bent = scratch_.bent;
  VectorXd& bending = scratch_.bending;
  VectorXd& change = scratch_.impulses;
  VectorXd& moved = scratch_.whole;
  bent = bent_ - scratch_.bend;
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
    if (!factorise()) return;
    find_bend(velocities);
    const VectorXd off = scratch_.bend;
    held_.rates(velocities, scratch_.rates);
    bent_ = without_soft(scratch_.rates - wanted_ - off);
    Motion held = motion;
    hold(held);
    const VectorXd change = held.velocities - velocities;
    const VectorXd& momenta = momenta_of(change);
    double share = -velocities.dot(momenta) / change.dot(momenta);
    if (!(share > 0)) break;
    share = std::min(share, 1.0);
    for (int k = 0; k < kHalvings; ++k) {
      find_bend(velocities + change * share);
      if (!(weighed(scratch_.bend) > weighed(off))) break;
      share /= 2;
    }
    velocities += change * share;
    motion.soft_impulses += (held.soft_impulses - motion.soft_impulses) * share;
    motion.gained += share * (velocities.dot(momenta) - share / 2 * change.dot(momenta));
  }
  held_.rates(velocities, scratch_.rates);
  bent_ = without_soft(scratch_.rates - wanted_);
}

const Eigen::Matrix3d& JointAssembly::inertia_of(Body& body) {
  if (!body.inertia) body.inertia = body.now.inverse_inertia.inverse();
  return *body.inertia;
}

const VectorXd& JointAssembly::momenta_of(const VectorXd& velocities) {
  VectorXd& momenta = scratch_.momenta;
  momenta.resize(velocities.size());
  Index first = 0;
  for (Body& body : bodies_) {
    momenta.segment<3>(first) = velocities.segment<3>(first) / body.now.inverse_mass;
    momenta.segment<3>(first + 3) = inertia_of(body) * velocities.segment<3>(first + 3);
    first += kBodyNumbers;
  }
  return momenta;
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

void JointAssembly::pass() {
  gives_.assign(free_count_, false);
  see_changes();
  if (has_diverged_ || is_settled_) return;
  Motion& moved = begin_motion();
  // What contacts have pushed turns fast about free axes until drives have answered, too: only then is it
  // known where it will be at the end of the step.
  if (is_pushed_ && free_count_ > 0) {
    hold(moved);
    is_held_ = true;
    solve_free(moved);
  }
  is_pushed_ = false;
  hold_at_end(moved);
  if (has_diverged_) return;
  if (free_count_ > 0) solve_free(moved);
  is_settled_ = (moved.velocities - velocities_).lpNorm<Eigen::Infinity>() * span_ <= kSettled;
  set_motion(moved);
}

void JointAssembly::move() {
  if (has_diverged_) return;
  see_changes();
  if (ways_count_ == ways_.size()) ways_.emplace_back();
  ways_[ways_count_++] = velocities_;
}

// To where move() has found the bodies to come in the steps before.
void JointAssembly::advance() {
  for (std::size_t n = 0; n < ways_count_; ++n) {
    find_turns(ways_[n], span_);
    for (Tie& tie : ties_) tie.joint.posed = after(tie, ways_[n], span_, Turns::kWhole);
    scratch_.way = ways_[n] * span_;
    shift_bodies(scratch_.way);
    if (has_rotors_) turn_rates_of_rotors(n + 1);
  }
  ways_count_ = 0;
}

// With the turns of find_turns().
void JointAssembly::shift_bodies(const VectorXd& way) {
  Index first = 0;
  for (std::size_t n = 0; n < bodies_.size(); ++n) {
    Body& body = bodies_[n];
    const Eigen::Quaterniond& turn = scratch_.turns[n];
    const Eigen::Matrix3d axes = turn.toRotationMatrix();
    body.now.inverse_inertia = axes * body.now.inverse_inertia * axes.transpose();
    body.inertia.reset();
    if (body.spin_axis) body.spin_axis = (turn * *body.spin_axis).normalized();
    body.moved.way += way.segment<3>(first);
    body.moved.turn = (turn * body.moved.turn).normalized();
    first += kBodyNumbers;
  }
}

// Held rows put no energy in, but for what the length of a step makes of turns: in mechanisms that hold, up
// to a tenth of what moves.
bool JointAssembly::gains_energy() {
  double mass = 0;
  for (const Body& body : bodies_) mass += 1 / body.now.inverse_mass;
  if (!(gained_ > kGainedMin * mass)) return false;
  const double kinetic = velocities_.dot(momenta_of(velocities_)) / 2;
  return !(gained_ <= kGainedMax * kinetic);
}

void JointAssembly::end(std::vector<BodyMotion>& moved) {
  constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
  const bool gains = !has_diverged_ && gains_energy();
  const bool stops = has_diverged_ || gains;
  if (moves_ && !stops) advance();
  Index first = 0;
  for (Body& body : bodies_) {
    body.moved.is_whole = moves_;
    if (spins(body) && !stops) body.moved.angular = velocities_.segment<3>(first + 3);
    first += kBodyNumbers;
    if (stops) body.moved.way = gains ? velocity_of_gained_energy() : Eigen::Vector3d::Constant(kNoNumber);
    moved.push_back(body.moved);
  }
}

}  // namespace tessera::joints
