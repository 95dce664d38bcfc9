// What drives, limits and rubs along the free axes of an assembly, all at once; and what contacts see of it.

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "lpss/base/invariant.h"
#include "lpss/joints/joint_assembly.h"

namespace tessera::joints {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

// More free rows are solved one after the other, pass by pass: what they do to each other is a matrix.
constexpr std::size_t kFreeAtOnceMax = 48;

// What holds within its bounds is taken to give way by this share at least, or a contact could not load it up
// to them: a slider that a motor drives into a wall.
constexpr double kHoldingGivesWay = 1e-5;

// Rounds in which rows are found that reach their bounds.
constexpr int kRoundsOfBounds = 4;

std::size_t place(int n) { return static_cast<std::size_t>(n); }

}  // namespace

double JointAssembly::missing_of(const FreeRow& free, const Motion& motion, const VectorXd& wanted) const {
  const FreeDirection& direction = directions_[free.direction];
  return free.velocity - direction.shares.dot(wanted) - direction.row.dot(motion.velocities) -
         free.compliance * free.impulse;
}

void JointAssembly::find_free_matrix() {
  factorised_.clear();
  if (free_count_ > kFreeAtOnceMax) return;
  const auto count = static_cast<Index>(free_count_);
  free_matrix_.resize(count, count);
  for (Index n = 0; n < count; ++n) {
    const FreeDirection& of = directions_[free_rows_[static_cast<std::size_t>(n)].direction];
    for (Index k = 0; k <= n; ++k) {
      const FreeDirection& by = directions_[free_rows_[static_cast<std::size_t>(k)].direction];
      free_matrix_(n, k) = free_matrix_(k, n) = of.row.dot(by.response);
    }
    free_matrix_(n, n) += free_rows_[static_cast<std::size_t>(n)].compliance;
  }
}

// Goes to the impulse, as far as its bounds allow; `missing` of all rows changes by that.
void JointAssembly::change_free(std::size_t n, double impulse, std::vector<double>& missing) {
  FreeRow& free = free_rows_[n];
  const double change = std::clamp(impulse, free.impulse_min, free.impulse_max) - free.impulse;
  if (change == 0) return;
  free.impulse += change;
  for (std::size_t k = 0; k < missing.size(); ++k)
    missing[k] -= free_matrix_(static_cast<Index>(k), static_cast<Index>(n)) * change;
}

// Those that stay within their bounds, as one system; others go to their bounds, and are left to passes over
// one after the other. Without it, what one axis takes up comes to the next one only pass by pass.
void JointAssembly::solve_free_at_once(std::vector<double>& missing) {
  std::vector<double>& changes = memory_.changes;
  std::vector<int>& chosen = memory_.chosen;
  changes.clear();  // also where all rows are at their bounds, and none is chosen
  chosen.clear();
  for (std::size_t n = 0; n < free_count_; ++n) {
    const FreeRow& free = free_rows_[n];
    const bool is_stuck =
        missing[n] > 0 ? free.impulse >= free.impulse_max : free.impulse <= free.impulse_min;
    if (!is_stuck) chosen.push_back(static_cast<int>(n));
  }
  for (int round = 0; round < kRoundsOfBounds && !chosen.empty(); ++round) {
    changes.clear();
    for (const int n : chosen) changes.push_back(missing[place(n)]);
    // From pass to pass they are mostly the same.
    if (chosen != factorised_) {
      free_system_.factorise(free_matrix_, chosen);
      factorised_ = chosen;
    }
    free_system_.solve(changes);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      const FreeRow& free = free_rows_[place(chosen[i])];
      const double impulse = free.impulse + changes[i];
      if (impulse >= free.impulse_min && impulse <= free.impulse_max) {
        chosen[kept++] = chosen[i];
      } else {
        change_free(place(chosen[i]), impulse, missing);
      }
    }
    if (kept == chosen.size()) break;
    chosen.resize(kept);
    changes.clear();
  }
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const std::size_t n = place(chosen[i]);
    change_free(n, free_rows_[n].impulse + changes[i], missing);
  }
}

// All at once as far as they are within their bounds, then one after the other; and these alone where there
// are many.
void JointAssembly::solve_free(Motion& motion) {
  VectorXd& wanted = memory_.held;
  wanted = wanted_ + bent_;
  if (free_count_ > kFreeAtOnceMax) {
    for (FreeRow& free : free_rows()) {
      const double mobility = directions_[free.direction].mobility + free.compliance;
      const double impulse = std::clamp(free.impulse + missing_of(free, motion, wanted) / mobility,
                                        free.impulse_min, free.impulse_max);
      push(motion, free, impulse - free.impulse);
      free.impulse = impulse;
    }
    return;
  }
  std::vector<double>& missing = memory_.missing;
  std::vector<double>& before = memory_.free_impulses;
  missing.clear();
  before.clear();
  for (const FreeRow& free : free_rows()) {
    missing.push_back(missing_of(free, motion, wanted));
    before.push_back(free.impulse);
  }
  if (free_count_ > 1) solve_free_at_once(missing);
  for (std::size_t n = 0; n < free_count_; ++n) {
    const double mobility = free_matrix_(static_cast<Index>(n), static_cast<Index>(n));
    change_free(n, free_rows_[n].impulse + missing[n] / mobility, missing);
  }
  for (std::size_t n = 0; n < free_count_; ++n) {
    const double change = free_rows_[n].impulse - before[n];
    if (change != 0) push(motion, free_rows_[n], change);
  }
}

std::size_t JointAssembly::touch(Index body) {
  const auto found = std::ranges::find(touched_, body);
  if (found != touched_.end()) return static_cast<std::size_t>(found - touched_.begin());
  touched_.push_back(body);
  return touched_.size() - 1;
}

// Columns are units of wrench on touched bodies.
void JointAssembly::find_touched_response() {
  const auto count = kBodyNumbers * static_cast<Index>(touched_.size());
  touched_held_.resize(count, count);
  RowsAtOnce& of = memory_.rows_at_once;
  for (Index first = 0; first < count; first += kSidesAtOnce) {
    const Index sides = std::min<Index>(kSidesAtOnce, count - first);
    of.rows.setZero(velocities_.size(), kSidesAtOnce);
    for (Index side = 0; side < sides; ++side) {
      const Index column = first + side;
      const Index body = touched_[static_cast<std::size_t>(column / kBodyNumbers)];
      of.rows(kBodyNumbers * body + column % kBodyNumbers, side) = 1;
    }
    find_shares(of.rows, of.shares);
    correct_shares(of.shares);
    take_out_held(of);
    for (std::size_t n = 0; n < touched_.size(); ++n) {
      touched_held_.block(kBodyNumbers * static_cast<Index>(n), first, kBodyNumbers, sides) =
          of.answers.block(kBodyNumbers * touched_[n], 0, kBodyNumbers, sides);
    }
  }
  const auto rows = static_cast<Index>(free_count_ <= kFreeAtOnceMax ? free_count_ : 0);
  touched_matrix_ = free_matrix_.topLeftCorner(rows, rows);
  for (Index n = 0; n < rows; ++n) {
    const FreeRow& free = free_rows_[static_cast<std::size_t>(n)];
    const double yields = kHoldingGivesWay * directions_[free.direction].mobility;
    touched_matrix_(n, n) += std::max(yields - free.compliance, 0.0);
  }
  touched_free_.resize(count, rows);
  for (Index n = 0; n < rows; ++n) {
    const VectorXd& answer = directions_[free_rows_[static_cast<std::size_t>(n)].direction].response;
    for (std::size_t k = 0; k < touched_.size(); ++k) {
      touched_free_.block<kBodyNumbers, 1>(kBodyNumbers * static_cast<Index>(k), n) =
          answer.segment<kBodyNumbers>(kBodyNumbers * touched_[k]);
    }
  }
}

bool JointAssembly::is_within(std::size_t n) const {
  const FreeRow& free = free_rows_[n];
  return free.impulse > free.impulse_min && free.impulse < free.impulse_max &&
         !(n < gives_.size() && gives_[n]);
}

bool JointAssembly::update_response() {
  const auto rows = [&] { return static_cast<std::size_t>(touched_free_.cols()); };
  const bool is_known = is_response_known_ && (rows() == free_count_ || rows() == 0);
  if (has_diverged_) {
    response_.setZero(kBodyNumbers * static_cast<Index>(touched_.size()),
                      kBodyNumbers * static_cast<Index>(touched_.size()));
    is_response_known_ = true;
    return true;
  }
  if (!is_known) find_touched_response();
  std::vector<int>& holding = memory_.chosen;
  holding.clear();
  for (std::size_t n = 0; n < rows(); ++n) {
    if (is_within(n)) holding.push_back(static_cast<int>(n));
  }
  if (is_known && holding == holding_) return false;
  is_response_known_ = true;
  holding_ = holding;
  response_ = touched_held_;
  touched_system_.factorise(touched_matrix_, holding_);
  std::vector<double>& impulses = memory_.changes;
  impulses.resize(holding_.size());
  for (Index column = 0; column < response_.cols(); ++column) {
    for (std::size_t i = 0; i < holding_.size(); ++i) impulses[i] = touched_free_(column, holding_[i]);
    touched_system_.solve(impulses);
    for (std::size_t i = 0; i < holding_.size(); ++i)
      response_.col(column) -= touched_free_.col(holding_[i]) * impulses[i];
  }
  return true;
}

bool JointAssembly::bears(std::span<const double> wrenches) {
  if (has_diverged_ || holding_.empty()) return true;
  const Eigen::Map<const VectorXd> all(wrenches.data(), static_cast<Index>(wrenches.size()));
  std::vector<double>& impulses = memory_.changes;
  impulses.resize(holding_.size());
  for (std::size_t i = 0; i < holding_.size(); ++i) impulses[i] = -touched_free_.col(holding_[i]).dot(all);
  touched_system_.solve(impulses);
  gives_.resize(free_count_);
  bool bears = true;
  for (std::size_t i = 0; i < holding_.size(); ++i) {
    const FreeRow& free = free_rows_[place(holding_[i])];
    const double impulse = free.impulse + impulses[i];
    if (impulse >= free.impulse_min && impulse <= free.impulse_max) continue;
    gives_[place(holding_[i])] = true;
    bears = false;
  }
  return bears;
}

}  // namespace tessera::joints
