// Makes the rows of an assembly, and matrices of them.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <span>
#include <vector>

#include "lpss/joints/joint_assembly.h"

namespace tessera::joints {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

// A row of which less is left by what is held than so many times what rows give way by is held itself: what
// moves then is a mechanism that jams, as far as its rows give way.
constexpr double kFree = 10;

}  // namespace

// A leader that is not here has gone.
void JointAssembly::add_links() {
  links_.clear();
  const auto follows = [](const JointAxis& axis) { return axis.mimic.is_set(); };
  if (std::ranges::none_of(ties_, [&](const Tie& tie) {
        return std::ranges::any_of(axes_of(*tie.joint.properties), follows);
      })) {
    return;
  }
  std::map<JointId, std::size_t> places;
  for (std::size_t n = 0; n < ties_.size(); ++n) places.emplace(ties_[n].joint.id, n);
  for (std::size_t n = 0; n < ties_.size(); ++n) {
    const JointProperties& follower = *ties_[n].joint.properties;
    for (int axis = 0; axis < axis_count(follower.type); ++axis) {
      const AxisMimic& mimic = follower.axes[static_cast<std::size_t>(axis)].mimic;
      const auto found = mimic.is_set() ? places.find(mimic.leader) : places.end();
      if (found == places.end()) continue;
      const JointProperties& leader = *ties_[found->second].joint.properties;
      if (mimic.axis >= axis_count(leader.type)) continue;
      links_.push_back({{follower, axis, leader}, n, found->second, {}});
    }
  }
}

void JointAssembly::make_rows() {
  Index count = static_cast<Index>(links_.size());
  for (Tie& tie : ties_) {
    make_tie_rows(tie);
    count += tie.held;
  }
  wanted_.resize(count);
  errors_.resize(count);
  compliances_.resize(count);
  const double parts = moves_ ? 1 : steps_;  // of what a row's impulse is shared among
  Index n = 0;
  for (const Tie& tie : ties_) {
    for (const JointRow& row : std::span(tie.rows).first(static_cast<std::size_t>(tie.held))) {
      wanted_[n] = row.velocity;
      errors_[n] = row.error;
      compliances_[n++] = row.compliance * parts;
    }
  }
  for (Link& link : links_) {
    link.rows = link.coupling.rows(posed_of(link.follower), posed_of(link.leader));
    wanted_[n] =
        parents_rate(ties_[link.follower], link.rows[0]) + parents_rate(ties_[link.leader], link.rows[1]);
    errors_[n] = link.coupling.error(posed_of(link.follower), posed_of(link.leader));
    compliances_[n++] = 0;
  }
  if ((compliances_.array() > 0).any()) {
    is_soft_ = (compliances_.array() > 0).cast<double>();
  } else {
    is_soft_.resize(0);
  }
  soft_impulses_.setZero(is_soft_.size());
  if (!factorise()) return;
  bent_.setZero(count);
  bending_.setZero(count);
  is_bent_ = false;
  is_held_ = false;
  is_foreseen_ = true;
  put_right();
}

void JointAssembly::make_tie_rows(Tie& tie) {
  const SolvedJoint& joint = tie.joint;
  const auto inertia_of = [&](Index body) {
    const JointedBody& now = bodies_[static_cast<std::size_t>(body)].now;
    return Inertia{now.inverse_mass, now.inverse_inertia};
  };
  tie.rows.clear();
  append_joint_rows(
      {*joint.properties, *joint.drives, joint.posed, tie.parent ? inertia_of(*tie.parent) : Inertia{},
       inertia_of(tie.child), span_, moves_ ? steps_ : 1},
      tie.rows);
  tie.held = std::ranges::count(tie.rows, true, &JointRow::is_held);
  if (tie.parent) return;
  for (JointRow& row : tie.rows) row.velocity += parents_rate(tie, row);
}

// The motion of a parent that nothing can push goes into the rows.
double JointAssembly::parents_rate(const Tie& tie, const JointRow& row) const {
  if (tie.parent) return 0;
  const JointSide& parent = tie.joint.posed.parent;
  return row.linear.dot(parent.linear_velocity) + row.angular_parent.dot(parent.angular_velocity);
}

// The bodies of each tie, then of each link.
void JointAssembly::make_nodes() {
  std::vector<HeldRows::NodeBodies>& nodes = scratch_.nodes;
  nodes.clear();
  const auto add = [&](const Tie& tie) {
    nodes.back().add(tie.child);
    if (tie.parent) nodes.back().add(*tie.parent);
  };
  for (const Tie& tie : ties_) {
    nodes.emplace_back();
    add(tie);
  }
  for (const Link& link : links_) {
    nodes.emplace_back();
    add(ties_[link.follower]);
    add(ties_[link.leader]);
  }
  held_.set_nodes(nodes, static_cast<Index>(bodies_.size()));
}

void JointAssembly::fill_held() {
  held_.clear();
  const auto add = [this](std::size_t node, const Tie& tie, const JointRow& row) {
    held_.add(node, tie.child, row.linear, row.angular_child);
    if (tie.parent) held_.add(node, *tie.parent, -row.linear, -row.angular_parent);
  };
  std::size_t node = 0;
  for (const Tie& tie : ties_) {
    for (const JointRow& row : std::span(tie.rows).first(static_cast<std::size_t>(tie.held))) {
      held_.add_row(node);
      add(node, tie, row);
    }
    ++node;
  }
  for (const Link& link : links_) {
    held_.add_row(node);
    add(node, ties_[link.follower], link.rows[0]);
    add(node, ties_[link.leader], link.rows[1]);
    ++node;
  }
}

void JointAssembly::put_over_bodies(const Tie& tie, const JointRow& row, VectorXd& whole) const {
  whole.setZero(velocities_.size());
  const auto put = [&](Index body, const Eigen::Vector3d& linear, const Eigen::Vector3d& angular) {
    whole.segment<3>(kBodyNumbers * body) = linear;
    whole.segment<3>(kBodyNumbers * body + 3) = angular;
  };
  put(tie.child, row.linear, row.angular_child);
  if (tie.parent) put(*tie.parent, -row.linear, -row.angular_parent);
}

// Of the velocities, to a unit of impulse.
void JointAssembly::find_answer(const VectorXd& row, VectorXd& answer) const {
  answer.resize(row.size());
  Index first = 0;
  for (const Body& body : bodies_) {
    answer.segment<3>(first) = body.now.inverse_mass * row.segment<3>(first);
    answer.segment<3>(first + 3) = body.now.inverse_inertia * row.segment<3>(first + 3);
    first += kBodyNumbers;
  }
}

// What is held of a row.
void JointAssembly::find_shares(FreeRow& free) {
  VectorXd& whole = scratch_.held;
  VectorXd& left = scratch_.rates;
  held_.answers(free.row, whole);
  held_.solve(whole, free.shares);
  held_.row(free.shares, scratch_.whole);
  held_.answers(scratch_.whole, left);
  left = whole - left;
  if (is_soft_.size() > 0) left -= compliances_.cwiseProduct(free.shares);
  held_.solve(left, scratch_.impulses);
  free.shares += scratch_.impulses;
}

// Rows that are made anew go on from the impulses of the step before.
void JointAssembly::add_free_rows() {
  std::vector<double>& before = scratch_.free_impulses;
  before.clear();
  for (const FreeRow& free : free_rows()) before.push_back(free.impulse);
  free_count_ = 0;
  for (const Tie& tie : ties_) {
    for (const JointRow& row : std::span(tie.rows).subspan(static_cast<std::size_t>(tie.held))) {
      if (free_count_ == free_rows_.size()) free_rows_.emplace_back();
      if (make_free_row(tie, row, free_rows_[free_count_])) ++free_count_;
    }
  }
  if (before.size() != free_count_) return;
  for (std::size_t i = 0; i < free_count_; ++i) {
    FreeRow& free = free_rows_[i];
    free.impulse = std::clamp(before[i], free.impulse_min, free.impulse_max);
  }
}

// Takes out of the row what is held, in the metric of the inverse masses. False if nothing is left.
bool JointAssembly::make_free_row(const Tie& tie, const JointRow& row, FreeRow& free) {
  const double parts = moves_ ? 1 : steps_;
  put_over_bodies(tie, row, free.row);
  find_answer(free.row, free.response);
  const double whole = free.row.dot(free.response);
  find_shares(free);
  if (is_soft_.size() > 0) {
    free.soft_shares = free.shares.cwiseProduct(is_soft_);
    free.shares -= free.soft_shares;
  }
  held_.row(free.shares, scratch_.whole);
  free.row -= scratch_.whole;
  find_answer(free.row, free.response);
  if (is_soft_.size() > 0) {
    held_.response(free.soft_shares, scratch_.whole);
    free.response -= scratch_.whole;
  }
  free.mobility = free.row.dot(free.response);
  if (!(free.mobility > kFree * gives_way_ * whole)) return false;
  const double return_max = kReturnSpeed * std::sqrt(std::min(free.mobility / whole, 1.0));
  free.velocity = row.velocity + std::clamp(row.return_velocity, -return_max, return_max);
  free.compliance = row.compliance * parts;
  free.impulse_min = row.impulse_min / parts;
  free.impulse_max = row.impulse_max / parts;
  free.impulse = 0;
  return true;
}

// Those without a compliance.
void JointAssembly::make_held_rows_after(const VectorXd& velocities) {
  std::vector<JointRow>& rows = scratch_.rows;
  find_turns(velocities, span_);
  for (Tie& tie : ties_) {
    rows.clear();
    append_held_rows(*tie.joint.properties, after(tie, velocities, span_), rows);
    std::copy(rows.begin(), rows.end(), tie.rows.begin());
  }
  for (Link& link : links_) {
    link.rows = link.coupling.rows(after(ties_[link.follower], velocities, span_),
                                   after(ties_[link.leader], velocities, span_));
  }
}

}  // namespace tessera::joints
