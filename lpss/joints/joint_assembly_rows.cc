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

// Likewise: a row of which so little is left would show it.
constexpr double kNearlyHeld = 1e4;

}  // namespace

// A leader that is not here has gone.
void JointAssembly::add_links() {
  links_.clear();
  const auto follows = [](const JointAxis& axis) { return axis.mimic.is_set(); };
  if (std::ranges::none_of(
          ties_, [&](const Tie& tie) { return std::ranges::any_of(axes_of(*tie.joint.form), follows); })) {
    return;
  }
  std::map<JointId, std::size_t> places;
  for (std::size_t n = 0; n < ties_.size(); ++n) places.emplace(ties_[n].joint.id, n);
  for (std::size_t n = 0; n < ties_.size(); ++n) {
    const JointForm& follower = *ties_[n].joint.form;
    for (int axis = 0; axis < axis_count(follower.type); ++axis) {
      const AxisMimic& mimic = follower.axes[static_cast<std::size_t>(axis)].mimic;
      const auto found = mimic.is_set() ? places.find(mimic.leader) : places.end();
      if (found == places.end()) continue;
      const JointForm& leader = *ties_[found->second].joint.form;
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
  armatures_.clear();
  for (std::size_t place = 0; place < ties_.size(); ++place) {
    const Tie& tie = ties_[place];
    for (std::size_t k = 0; k < static_cast<std::size_t>(tie.held); ++k) {
      const JointRow& row = tie.rows[k];
      wanted_[n] = row.velocity;
      errors_[n] = row.error;
      compliances_[n] = row.compliance * parts;
      if (row.armature > 0) {
        armatures_.push_back({place, k, n, 1 / compliances_[n]});
        compliances_[n] = 1 / (armatures_.back().yields + row.armature);
      }
      ++n;
    }
  }
  aim_armatures();
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
      {*joint.form, *joint.drives, joint.posed, tie.parent ? inertia_of(*tie.parent) : Inertia{},
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

// Relative to the parent.
double JointAssembly::rate_of(const Tie& tie, const JointRow& row) const {
  const auto child = velocities_.segment<6>(kBodyNumbers * tie.child);
  double rate = row.linear.dot(child.head<3>()) + row.angular_child.dot(child.tail<3>());
  if (!tie.parent) return rate - parents_rate(tie, row);
  const auto parent = velocities_.segment<6>(kBodyNumbers * *tie.parent);
  return rate - row.linear.dot(parent.head<3>()) - row.angular_parent.dot(parent.tail<3>());
}

// With the rows of the step before: what turns an axis changes none of the rate about it.
void JointAssembly::note_rates() {
  for (Tie& tie : ties_) {
    const JointForm& form = *tie.joint.form;
    for (std::size_t n = 0; n < axes_of(form).size(); ++n) {
      if (form.axes[n].armature > 0)
        tie.rates[n] = rate_of(tie, axis_row(form.type, tie.joint.posed, static_cast<int>(n)));
    }
  }
}

// What spring and damper want, and the rate at the beginning of the step, by how firmly each does.
void JointAssembly::aim_armatures() {
  for (const Armature& of : armatures_) {
    const Tie& tie = ties_[of.tie];
    const JointRow& row = tie.rows[of.row];
    const double rate = tie.rates[static_cast<std::size_t>(row.axis)] + parents_rate(tie, row);
    wanted_[of.held] = (of.yields * row.velocity + row.armature * rate) * compliances_[of.held];
  }
}

// The bodies of each tie, then of each link.
void JointAssembly::make_nodes() {
  std::vector<HeldRows::NodeBodies>& nodes = memory_.nodes;
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

// Of the velocities, to a unit of impulse of each row.
void JointAssembly::find_answers(const Sides& rows, Sides& answers) const {
  answers.resize(rows.rows(), kSidesAtOnce);
  Index first = 0;
  for (const Body& body : bodies_) {
    answers.middleRows<3>(first) = body.now.inverse_mass * rows.middleRows<3>(first);
    answers.middleRows<3>(first + 3).noalias() =
        body.now.inverse_inertia.lazyProduct(rows.middleRows<3>(first + 3));
    first += kBodyNumbers;
  }
}

// What is held of rows.
void JointAssembly::find_shares(const Sides& rows, Sides& shares) {
  held_.answers(rows, memory_.held_sides);
  held_.solve(memory_.held_sides, shares);
}

// Takes out what held rows give way by.
void JointAssembly::correct_shares(Sides& shares) {
  Sides& held = memory_.held_sides;
  Sides& correction = memory_.correction_sides;
  held = (gives_way_ * held_.diagonal()).asDiagonal() * shares;
  held_.solve(held, correction);
  shares += correction;
}

// Several rows may act along one: friction, a drive, limits.
std::size_t JointAssembly::direction_of(const Tie& tie, const JointRow& row) {
  for (std::size_t n = directions_count_; n-- > 0 && directions_[n].tie == &tie;) {
    const JointRow& axis = *directions_[n].axis;
    if (axis.linear == row.linear && axis.angular_child == row.angular_child &&
        axis.angular_parent == row.angular_parent) {
      return n;
    }
  }
  if (directions_count_ == directions_.size()) directions_.emplace_back();
  directions_[directions_count_].tie = &tie;
  directions_[directions_count_].axis = &row;
  return directions_count_++;
}

// Rows that are made anew go on from the impulses of the step before.
void JointAssembly::add_free_rows() {
  std::vector<double>& before = memory_.free_impulses;
  before.clear();
  for (const FreeRow& free : free_rows()) before.push_back(free.impulse);
  free_count_ = 0;
  directions_count_ = 0;
  for (const Tie& tie : ties_) {
    for (const JointRow& row : std::span(tie.rows).subspan(static_cast<std::size_t>(tie.held))) {
      if (free_count_ == free_rows_.size()) free_rows_.emplace_back();
      free_rows_[free_count_++] = {.row = &row, .direction = direction_of(tie, row)};
    }
  }
  const std::span directions(directions_.data(), directions_count_);
  for (std::size_t n = 0; n < directions.size(); n += kSidesAtOnce)
    make_directions(directions.subspan(n, std::min<std::size_t>(kSidesAtOnce, directions.size() - n)));
  std::size_t kept = 0;
  for (FreeRow& free : free_rows()) {
    if (make_free_row(free)) free_rows_[kept++] = free;
  }
  free_count_ = kept;
  find_free_matrix();
  if (before.size() != free_count_) return;
  for (std::size_t i = 0; i < free_count_; ++i) {
    FreeRow& free = free_rows_[i];
    free.impulse = std::clamp(before[i], free.impulse_min, free.impulse_max);
  }
}

// Takes out of rows what is held, in the metric of the inverse masses.
void JointAssembly::make_directions(std::span<FreeDirection> directions) {
  using OfSides = Eigen::Matrix<double, 1, kSidesAtOnce>;
  RowsAtOnce& of = memory_.rows_at_once;
  of.rows.setZero(velocities_.size(), kSidesAtOnce);
  Index side = 0;
  for (const FreeDirection& direction : directions) {
    const auto put = [&](Index body, const Eigen::Vector3d& linear, const Eigen::Vector3d& angular) {
      of.rows.block<3, 1>(kBodyNumbers * body, side) = linear;
      of.rows.block<3, 1>(kBodyNumbers * body + 3, side) = angular;
    };
    const Tie& tie = *direction.tie;
    put(tie.child, direction.axis->linear, direction.axis->angular_child);
    if (tie.parent) put(*tie.parent, -direction.axis->linear, -direction.axis->angular_parent);
    ++side;
  }
  find_answers(of.rows, of.answers);
  const auto mobilities = [&of]() -> OfSides { return of.rows.cwiseProduct(of.answers).colwise().sum(); };
  const OfSides whole = mobilities();
  find_shares(of.rows, of.shares);
  Sides& rows = memory_.whole_sides;
  rows = of.rows;
  take_out_held(of);
  OfSides mobility = mobilities();
  if ((mobility.array() < whole.array() * (kNearlyHeld * gives_way_)).any()) {
    of.rows = rows;
    find_shares(of.rows, of.shares);
    correct_shares(of.shares);
    take_out_held(of);
    mobility = mobilities();
  }
  side = 0;
  for (FreeDirection& direction : directions) {
    direction.row = of.rows.col(side);
    direction.response = of.answers.col(side);
    direction.shares = of.shares.col(side);
    if (is_soft_.size() > 0) direction.soft_shares = of.soft_shares.col(side);
    direction.whole = whole[side];
    direction.mobility = mobility[side++];
  }
}

// Of rows, what is held, by their shares; of the answers to them, too, what soft rows do then.
void JointAssembly::take_out_held(RowsAtOnce& of) {
  Sides& combined = memory_.combined_sides;
  if (is_soft_.size() > 0) {
    of.soft_shares = is_soft_.asDiagonal() * of.shares;
    of.shares -= of.soft_shares;
  }
  held_.row(of.shares, combined);
  of.rows -= combined;
  find_answers(of.rows, of.answers);
  if (is_soft_.size() > 0) {
    held_.response(of.soft_shares, combined);
    of.answers -= combined;
  }
}

// False if nothing is left of it by what is held.
bool JointAssembly::make_free_row(FreeRow& free) const {
  const double parts = moves_ ? 1 : steps_;
  const JointRow& row = *free.row;
  const FreeDirection& direction = directions_[free.direction];
  if (!(direction.mobility > kFree * gives_way_ * direction.whole)) return false;
  const double return_max = kReturnSpeed * std::sqrt(std::min(direction.mobility / direction.whole, 1.0));
  free.velocity = row.velocity + std::clamp(row.return_velocity, -return_max, return_max);
  free.compliance = row.compliance * parts;
  free.impulse_min = row.impulse_min / parts;
  free.impulse_max = row.impulse_max / parts;
  free.impulse = 0;
  return true;
}

// Those without a compliance.
void JointAssembly::make_held_rows_after(const VectorXd& velocities) {
  std::vector<JointRow>& rows = memory_.rows;
  const BodyTurns& turns = turns_in(velocities, span_);
  for (Tie& tie : ties_) {
    rows.clear();
    append_held_rows(*tie.joint.form, after(tie, velocities, span_, turns.of(turns_for(tie))), rows);
    std::copy(rows.begin(), rows.end(), tie.rows.begin());
  }
  for (Link& link : links_) {
    link.rows = link.coupling.rows(after(ties_[link.follower], velocities, span_, turns.whole),
                                   after(ties_[link.leader], velocities, span_, turns.whole));
  }
}

}  // namespace tessera::joints
