#include "lpss/joints/joint_assembly.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "lpss/base/divergence_kind.h"
#include "lpss/base/rotation.h"
#include "lpss/base/torque_free.h"

namespace tessera::joints {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

// By this share of what holds it, a row gives way, so that rows which imply one another have a solution. In a
// loop they do so nearly, and up to the rounding of poses: were rows to give way by less than that, errors
// that nothing can correct would move what is free.
constexpr double kTreeGivesWay = 1e-9;
constexpr double kLoopGivesWay = 1e-7;

// With so many axes that may have rows of their own, an assembly has its rows anew in each step; with more
// only if it turns far, since each of these is a vector over all bodies.
constexpr std::ptrdiff_t kAxesAnewMax = 500;

// rad, in one tick. What turns farther moves step by step.
constexpr double kTurnWhole = 0.25;

// An assembly has diverged if held rows have made more than this share of its energy of motion in one tick,
// and more than so much: J/kg.
constexpr double kGainedMax = 0.5;
constexpr double kGainedMin = 0.01;

// By this ratio from pass to pass, at most.
constexpr double kConverges = 0.1;

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
                         {body, Eigen::Vector3d::Zero(), Eigen::Quaterniond::Identity(), false},
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
  tie.impulses = {};
}

void JointAssembly::begin(double dt, int steps) {
  ties_.resize(ties_count_);
  steps_ = steps;
  span_ = dt;
  free_count_ = 0;
  gained_ = 0;
  is_settled_ = has_diverged_ = false;
  is_pushed_ = awaits_answer_ = false;
  is_response_known_ = false;
  gives_.clear();
  ways_count_ = 0;
  add_links();
  make_nodes();
  is_anchored_ = std::ranges::any_of(ties_, [](const Tie& tie) { return !tie.parent; });
  find_rotors();
  const bool loops = has_loop();
  gives_way_ = loops ? kLoopGivesWay : kTreeGivesWay;
  has_begun_ = false;
  ends_.clear();
  if (!loops) find_ends();
  velocities_.resize(kBodyNumbers * static_cast<Index>(bodies_.size()));
  Index first = 0;
  for (const Body& body : bodies_) {
    velocities_.segment<3>(first) = body.now.linear;
    velocities_.segment<3>(first + 3) = body.now.angular;
    first += kBodyNumbers;
  }
  has_armatures_ = std::ranges::any_of(ties_, [](const Tie& tie) {
    return std::ranges::any_of(axes_of(*tie.joint.form),
                               [](const JointAxis& axis) { return axis.armature > 0; });
  });
  if (has_armatures_) note_rates();
  moves_ = steps > 1 && axes_with_rows() <= kAxesAnewMax;
  if (moves_) {
    span_ /= steps;
  } else {
    make_rows();
  }
}

bool JointAssembly::has_loop() {
  const std::size_t world = bodies_.size();
  DisjointSets& sets = memory_.sets;
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
    const std::span<const JointAxis> axes = axes_of(*tie.joint.form);
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

// False where the rows have no solution: the assembly has diverged.
bool JointAssembly::factorise() {
  fill_held();
  std::vector<Inertia>& inertia = memory_.inertia;
  inertia.clear();
  for (const Body& body : bodies_) inertia.push_back({body.now.inverse_mass, body.now.inverse_inertia});
  has_diverged_ = !held_.factorise(inertia, gives_way_, compliances_, patterns_);
  if (has_diverged_) return false;
  weights_ = held_.diagonal().cwiseInverse();
  add_free_rows();
  return true;
}

void JointAssembly::push(Index body, const Velocities& change) {
  velocities_.segment<6>(kBodyNumbers * body) += change;
  if (has_begun_) pushed_.segment<6>(kBodyNumbers * body) += change;
  is_held_ = is_settled_ = false;
  is_pushed_ = awaits_answer_ = true;
  changed_ = 0;
}

// Velocities out of all range are not shown to others, which contacts would push to wherever these go.
void JointAssembly::set_motion(const Motion& motion) {
  const VectorXd& velocities = motion.velocities;
  const auto is_bounded = [](double speed) { return std::abs(speed) <= kBeyondSpeed; };  // and a number
  has_diverged_ = has_diverged_ || !std::all_of(velocities.begin(), velocities.end(), is_bounded);
  if (has_diverged_) return;
  velocities_ = velocities;
  soft_impulses_ = motion.soft_impulses;
  gained_ += motion.gained;
}

void JointAssembly::start_step() {
  if (has_diverged_) return;
  note_impulses();
  is_settled_ = is_held_ = is_pushed_ = awaits_answer_ = false;
  changed_ = 0;
  if (has_armatures_) note_rates();
  if (!moves_) aim_armatures();
  Index first = 0;
  for (const Body& body : bodies_) {
    velocities_.segment<3>(first) += body.now.linear_force / steps_;
    velocities_.segment<3>(first + 3) += body.now.angular_force / steps_;
    first += kBodyNumbers;
  }
  soft_impulses_.setZero();
  find_whether_to_move();
  if (moves_) {
    advance();
    make_rows();
  }
  if (has_diverged_) return;
  turn_freely();
  begin_impulses();
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
  memory_.moved.velocities = velocities_;
  memory_.moved.soft_impulses = soft_impulses_;
  memory_.moved.gained = 0;
  return memory_.moved;
}

void JointAssembly::push(Motion& motion, const FreeRow& free, double impulse) const {
  const FreeDirection& direction = directions_[free.direction];
  motion.velocities += direction.response * impulse;
  if (is_soft_.size() > 0) motion.soft_impulses -= direction.soft_shares * impulse;
}

// Of each body, in a time at these velocities. Valid until the next call.
const JointAssembly::BodyTurns& JointAssembly::turns_in(const VectorXd& velocities, double time) {
  BodyTurns& turns = memory_.turns;
  turns.whole.clear();
  turns.tilts.clear();
  for (Index first = 0; first < velocities.size(); first += kBodyNumbers)
    turns.whole.push_back(rotation_by(velocities.segment<3>(first + 3) * time));
  if (has_rotors_) split_turns_of_rotors(velocities, time, turns);
  return turns;
}

// Both sides of a joint after a time at these velocities, in which bodies make these turns.
JointPoses JointAssembly::poses_after(const Tie& tie, const VectorXd& velocities, double time,
                                      std::span<const Eigen::Quaterniond> turns) const {
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

PosedJoint JointAssembly::after(const Tie& tie, const VectorXd& velocities, double time,
                                std::span<const Eigen::Quaterniond> turns) const {
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

const Eigen::Matrix3d& JointAssembly::inertia_of(Body& body) {
  if (!body.inertia) body.inertia = body.now.inverse_inertia.inverse();
  return *body.inertia;
}

const VectorXd& JointAssembly::momenta_of(const VectorXd& velocities) {
  VectorXd& momenta = memory_.momenta;
  momenta.resize(velocities.size());
  Index first = 0;
  for (Body& body : bodies_) {
    momenta.segment<3>(first) = velocities.segment<3>(first) / body.now.inverse_mass;
    momenta.segment<3>(first + 3) = inertia_of(body) * velocities.segment<3>(first + 3);
    first += kBodyNumbers;
  }
  return momenta;
}

void JointAssembly::pass() {
  gives_.assign(free_count_, false);
  awaits_answer_ = false;
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
  find_whether_settled((moved.velocities - velocities_).lpNorm<Eigen::Infinity>() * span_);
  set_motion(moved);
}

// By how much a pass has changed the way of the step (m or rad). Where it converges, the next pass would
// change less by at least the same ratio.
void JointAssembly::find_whether_settled(double change) {
  const bool converges = change <= kConverges * changed_;
  is_settled_ = change <= kSettled || (converges && change * change <= kSettled * changed_);
  changed_ = change;
}

void JointAssembly::move() {
  if (has_diverged_) return;
  awaits_answer_ = false;
  if (ways_count_ == ways_.size()) ways_.emplace_back();
  ways_[ways_count_++] = velocities_;
}

void JointAssembly::end_step() {
  if (moves_ || has_diverged_) return;
  if (ways_count_ == 1) opened_.setZero(velocities_.size());
  stays_ = velocities_;
  add_opened(ways_[ways_count_ - 1], step_time());
}

// How much farther bodies get in a time by the velocities that they had than by those that they have.
void JointAssembly::add_opened(const VectorXd& had, double time) { opened_ += (had - velocities_) * time; }

// To where move() has found the bodies to come in the steps before.
void JointAssembly::advance() {
  for (std::size_t n = 0; n < ways_count_; ++n) {
    const BodyTurns& turns = turns_in(ways_[n], span_);
    for (Tie& tie : ties_) tie.joint.posed = after(tie, ways_[n], span_, turns.whole);
    memory_.way = ways_[n] * span_;
    shift_bodies(memory_.way, turns.whole);
    if (has_rotors_) turn_rates_of_rotors(turns.tilts, n + 1);
  }
  ways_count_ = 0;
}

void JointAssembly::shift_bodies(const VectorXd& way, std::span<const Eigen::Quaterniond> turns) {
  Index first = 0;
  for (std::size_t n = 0; n < bodies_.size(); ++n) {
    Body& body = bodies_[n];
    const Eigen::Quaterniond& turn = turns[n];
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
  if (!has_diverged_) note_impulses();
  const bool gains = !has_diverged_ && gains_energy();
  const bool stops = has_diverged_ || gains;
  if (moves_ && !stops) advance();
  const bool has_opened = !moves_ && !has_diverged_ && ways_count_ > 0;
  if (has_opened) add_opened(stays_, span_);
  Index first = 0;
  for (Body& body : bodies_) {
    BodyMotion& motion = moved.emplace_back(body.moved);
    motion.is_whole = moves_;
    motion.linear = velocities_.segment<3>(first);
    motion.angular = velocities_.segment<3>(first + 3);
    if (has_opened) {
      motion.way += opened_.segment<3>(first);
      motion.turn = rotation_by(opened_.segment<3>(first + 3)) * motion.turn;
    }
    first += kBodyNumbers;
    if (stops) motion.way = gains ? velocity_of_gained_energy() : Eigen::Vector3d::Constant(kNoNumber);
  }
}

}  // namespace tessera::joints
