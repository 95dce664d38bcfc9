#include "lpss/joints/joint_coupling.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace tessera::joints {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

// A multiplier is taken for a ratio with a denominator up to this, if it is one up to rounding.
constexpr int kTeethMax = 1000;
constexpr double kRounding = 1e-12;

// The least denominator of a ratio; 0 if there is none.
int denominator_of(double ratio) {
  for (int q = 1; q <= kTeethMax; ++q) {
    const double whole = ratio * q;
    if (std::abs(whole - std::round(whole)) <= kRounding * std::max(1.0, std::abs(whole))) return q;
  }
  return 0;
}

double period_of(bool follower_turns, bool leader_turns, double multiplier) {
  if (leader_turns && multiplier != 0) {
    if (!follower_turns) return kTurn * std::abs(multiplier);
    const int teeth = denominator_of(multiplier);
    return teeth > 0 ? kTurn / teeth : 0;
  }
  return follower_turns ? kTurn : kUnbounded;
}

}  // namespace

JointCoupling::JointCoupling(const JointForm& follower, int axis, const JointForm& leader)
    : follower_(&follower),
      leader_(&leader),
      axis_(axis),
      mimic_(follower.axes[static_cast<std::size_t>(axis)].mimic),
      period_(period_of(turns_freely(follower, axis), turns_freely(leader, mimic_.axis), mimic_.multiplier)) {
}

double JointCoupling::error(const PosedJoint& follower, const PosedJoint& leader) const {
  const double wanted =
      mimic_.multiplier * (axis_position(*leader_, leader, mimic_.axis) - mimic_.reference) + mimic_.offset;
  const double error = axis_position(*follower_, follower, axis_) - wanted;
  if (period_ == 0) return 0;
  return period_ < kUnbounded ? std::remainder(error, period_) : error;
}

std::array<JointRow, 2> JointCoupling::rows(const PosedJoint& follower, const PosedJoint& leader) const {
  std::array<JointRow, 2> rows = {axis_row(follower_->type, follower, axis_),
                                  axis_row(leader_->type, leader, mimic_.axis)};
  rows[1].linear *= -mimic_.multiplier;
  rows[1].angular_child *= -mimic_.multiplier;
  rows[1].angular_parent *= -mimic_.multiplier;
  return rows;
}

}  // namespace tessera::joints
