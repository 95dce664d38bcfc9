#include "lpss/bullet/joint_assembly.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <utility>

#include "lpss/base/invariant.h"
#include "lpss/base/rotation.h"
#include "lpss/bullet/conversions.h"

namespace tessera::bullet {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using Matrix = Eigen::SparseMatrix<double>;

// By this share of what holds it, a row gives way, so that rows which imply one another have a solution.
constexpr double kGivesWay = 1e-9;

// A row of which less is left by what is held is held itself.
constexpr double kFree = 1e-9;

// rad, in one tick. What turns farther moves step by step.
constexpr double kTurnWhole = 0.25;

// rad, in one step. Where a body turns farther, its arc is not foreseen: Newton's method would diverge.
constexpr double kTurnForeseen = 0.7;

constexpr Index kNumbers = 6;  // of a body's velocities: linear, angular

}  // namespace

JointAssembly::JointAssembly(std::vector<SolvedJoint> joints, std::span<const JointedBody> bodies, double dt,
                             int steps)
    : steps_(steps), span_(dt) {
  std::map<int, Index> places;
  const auto place_of = [&](int body) {
    const auto [place, is_new] = places.emplace(body, static_cast<Index>(bodies_.size()));
    if (is_new) {
      bodies_.push_back({bodies[static_cast<std::size_t>(body)],
                         {body, Eigen::Vector3d::Zero(), Eigen::Quaterniond::Identity()}});
    }
    return place->second;
  };
  for (SolvedJoint& joint : joints) {
    Tie& tie = ties_.emplace_back();
    tie.child = place_of(joint.child);
    if (joint.parent) tie.parent = place_of(*joint.parent);
    tie.joint = std::move(joint);
  }
  make_rows();
}

// As the velocities are now: a whip cracks within a tick.
void JointAssembly::find_whether_to_move() {
  if (moves_ || steps_ == 1) return;
  VectorXd held = velocities();
  hold(held);
  if (!turns_beyond(kTurnWhole, velocities(), span_) && !turns_beyond(kTurnWhole, held, span_)) return;
  moves_ = true;
  span_ /= steps_;
}

bool JointAssembly::turns_beyond(double turn, const VectorXd& velocities, double time) const {
  for (Index first = 0; first < velocities.size(); first += kNumbers) {
    if (!(velocities.segment<3>(first + 3).norm() * time <= turn)) return true;
  }
  return false;
}

// The motion of a parent that nothing can push goes into the rows.
void JointAssembly::make_rows() {
  std::vector<double> wanted;
  for (Tie& tie : ties_) {
    const SolvedJoint& joint = tie.joint;
    tie.rows.clear();
    append_joint_rows(*joint.properties, *joint.drives, joint.posed, span_, moves_ ? steps_ : 1, tie.rows);
    for (JointRow& row : tie.rows) {
      if (!tie.parent) {
        const JointSide& parent = joint.posed.parent;
        row.velocity +=
            row.linear.dot(parent.linear_velocity) + row.angular_parent.dot(parent.angular_velocity);
      }
      if (row.is_held) wanted.push_back(row.velocity);
    }
  }
  wanted_ = Eigen::Map<const VectorXd>(wanted.data(), static_cast<Index>(wanted.size()));
  wanted_now_ = wanted_;
  held_ = columns(/*is_held=*/true);
  const Matrix masses = inverse_masses();
  response_ = masses * held_;
  Matrix matrix = held_.transpose() * response_;
  for (Index i = 0; i < matrix.rows(); ++i) matrix.coeffRef(i, i) *= 1 + kGivesWay;
  factors_.compute(matrix);
  invariant(factors_.info() == Eigen::Success, "what joints hold can be solved for");
  add_free_rows(masses);
}

Matrix JointAssembly::columns(bool is_held) const {
  std::vector<Eigen::Triplet<double>> entries;
  Index column = 0;
  const auto append = [&](Index body, const Eigen::Vector3d& linear, const Eigen::Vector3d& angular) {
    const Index first = kNumbers * body;
    for (Index i = 0; i < 3; ++i) {
      entries.emplace_back(first + i, column, linear[i]);
      entries.emplace_back(first + 3 + i, column, angular[i]);
    }
  };
  for (const Tie& tie : ties_) {
    for (const JointRow& row : tie.rows) {
      if (row.is_held != is_held) continue;
      append(tie.child, row.linear, row.angular_child);
      if (tie.parent) append(*tie.parent, -row.linear, -row.angular_parent);
      ++column;
    }
  }
  Matrix matrix(kNumbers * static_cast<Index>(bodies_.size()), column);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

Matrix JointAssembly::inverse_masses() const {
  std::vector<Eigen::Triplet<double>> entries;
  Index first = 0;
  for (const Body& body : bodies_) {
    for (Index i = 0; i < 3; ++i) {
      entries.emplace_back(first + i, first + i, body.now.inverse_mass);
      for (Index j = 0; j < 3; ++j)
        entries.emplace_back(first + 3 + i, first + 3 + j, body.now.inverse_inertia(i, j));
    }
    first += kNumbers;
  }
  Matrix matrix(first, first);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

// Takes out of each row what is held, in the metric of the inverse masses. Rows that are made anew go on from
// the impulses of the step before.
void JointAssembly::add_free_rows(const Matrix& masses) {
  const std::vector<FreeRow> before = std::exchange(free_rows_, {});
  const Matrix rows = columns(/*is_held=*/false);
  const double parts = moves_ ? 1 : steps_;  // of what a row's impulse is shared among
  Index column = 0;
  for (const Tie& tie : ties_) {
    for (const JointRow& row : tie.rows) {
      if (row.is_held) continue;
      FreeRow free;
      free.row = rows.col(column++);
      const double whole = free.row.dot(masses * free.row);
      free.shares = factors_.solve(response_.transpose() * free.row);
      free.row -= held_ * free.shares;
      free.response = masses * free.row;
      free.mobility = free.row.dot(free.response);
      if (!(free.mobility > kFree * whole)) continue;
      free.velocity = row.velocity;
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

VectorXd JointAssembly::velocities() const {
  VectorXd velocities(kNumbers * static_cast<Index>(bodies_.size()));
  Index first = 0;
  for (const auto& [now, moved] : bodies_) {
    velocities.segment<3>(first) = now.linear + to_eigen(*now.linear_change);
    velocities.segment<3>(first + 3) = now.angular + to_eigen(*now.angular_change);
    first += kNumbers;
  }
  return velocities;
}

void JointAssembly::set_velocities(const VectorXd& velocities) {
  Index first = 0;
  for (const auto& [now, moved] : bodies_) {
    *now.linear_change = to_bullet(Eigen::Vector3d(velocities.segment<3>(first) - now.linear));
    *now.angular_change = to_bullet(Eigen::Vector3d(velocities.segment<3>(first + 3) - now.angular));
    first += kNumbers;
  }
}

void JointAssembly::start_step() {
  find_whether_to_move();
  if (moves_) {
    advance();
    make_rows();
  }
  if (free_rows_.empty()) return;
  VectorXd moved = velocities();
  for (const FreeRow& free : free_rows_) moved += free.response * free.impulse;
  set_velocities(moved);
}

void JointAssembly::hold(VectorXd& velocities) const {
  velocities += response_ * factors_.solve(wanted_ - held_.transpose() * velocities);
}

// Both sides of a joint after a time at these velocities.
PosedJoint JointAssembly::after(const Tie& tie, const VectorXd& velocities, double time) const {
  const auto moved_by = [&](JointSide side, Index body) {
    side.linear_velocity = velocities.segment<3>(kNumbers * body);
    side.angular_velocity = velocities.segment<3>(kNumbers * body + 3);
    return bullet::moved(side, time);
  };
  PosedJoint end = tie.joint.posed;
  end.child = moved_by(end.child, tie.child);
  end.parent = tie.parent ? moved_by(end.parent, *tie.parent) : bullet::moved(end.parent, time);
  return end;
}

// By how much more than what may be left of it each error will be off once the bodies have moved.
VectorXd JointAssembly::excess(const VectorXd& velocities) const {
  VectorXd excess(wanted_.size());
  std::vector<JointRow> rows;
  Index n = 0;
  for (const Tie& tie : ties_) {
    rows.clear();
    append_held_rows(*tie.joint.properties, after(tie, velocities, span_), span_, rows);
    for (std::size_t i = 0; i < rows.size(); ++i, ++n) {
      excess[n] = rows[i].error - kErrorLeft * tie.rows[i].error;
    }
  }
  return excess;
}

// One step of Newton's method towards no excess. What turns too fast for that is held along its rows as they
// are.
void JointAssembly::hold_at_end(VectorXd& velocities) {
  hold(velocities);
  if (turns_beyond(kTurnForeseen, velocities, span_)) {
    wanted_ = wanted_now_;
  } else {
    wanted_ -= excess(velocities) / span_;
  }
  hold(velocities);
}

void JointAssembly::pass() {
  VectorXd moved = velocities();
  hold_at_end(moved);
  for (FreeRow& free : free_rows_) {
    const double missing =
        free.velocity - free.shares.dot(wanted_) - free.row.dot(moved) - free.compliance * free.impulse;
    const double impulse = std::clamp(free.impulse + missing / (free.mobility + free.compliance),
                                      free.impulse_min, free.impulse_max);
    moved += free.response * (impulse - free.impulse);
    free.impulse = impulse;
  }
  set_velocities(moved);
}

void JointAssembly::move() { ways_.push_back(velocities()); }

// To where move() has found the bodies to come in the steps before.
void JointAssembly::advance() {
  for (const VectorXd& velocities : ways_) {
    for (Tie& tie : ties_) tie.joint.posed = after(tie, velocities, span_);
    Index first = 0;
    for (auto& [now, moved] : bodies_) {
      const Eigen::Quaterniond turn = rotation_by(velocities.segment<3>(first + 3) * span_);
      const Eigen::Matrix3d axes = turn.toRotationMatrix();
      now.inverse_inertia = axes * now.inverse_inertia * axes.transpose();
      moved.way += velocities.segment<3>(first) * span_;
      moved.turn = (turn * moved.turn).normalized();
      first += kNumbers;
    }
  }
  ways_.clear();
}

void JointAssembly::end(std::vector<BodyMotion>& moved) {
  if (!moves_) return;
  advance();
  for (const Body& body : bodies_) moved.push_back(body.moved);
}

}  // namespace tessera::bullet
