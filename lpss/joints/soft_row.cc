#include "lpss/joints/soft_row.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "lpss/base/invariant.h"

namespace tessera::joints {
namespace {

// (angular frequency * dt)^2, from which on a step no longer resolves a period, and at which it does not at
// all.
constexpr double kResolved = 0.25;
constexpr double kUnresolved = 1;

// N s per m/s, or N m s per rad/s: what resists less is not felt by the lightest body.
constexpr double kFelt = 1e-100;

// Of the velocities of the child, then of the parent: linear, angular.
using RowNumbers = Eigen::Matrix<double, 12, 1>;

RowNumbers numbers_of(const JointRow& row) {
  RowNumbers numbers;
  numbers.segment<3>(0) = row.linear;
  numbers.segment<3>(3) = row.angular_child;
  numbers.segment<3>(6) = -row.linear;
  numbers.segment<3>(9) = -row.angular_parent;
  return numbers;
}

RowNumbers response_to(const RowNumbers& impulse, const JointStep& step) {
  RowNumbers response;
  response.segment<3>(0) = step.child.inverse_mass * impulse.segment<3>(0);
  response.segment<3>(3).noalias() = step.child.inverse_inertia.lazyProduct(impulse.segment<3>(3));
  response.segment<3>(6) = step.parent.inverse_mass * impulse.segment<3>(6);
  response.segment<3>(9).noalias() = step.parent.inverse_inertia.lazyProduct(impulse.segment<3>(9));
  return response;
}

}  // namespace

bool soften(const SoftEffort& effort, double dt, JointRow& row) {
  const double square = effort.stiffness * effort.mobility * dt * dt;
  const double unresolved = std::clamp((square - kResolved) / (kUnresolved - kResolved), 0.0, 1.0);
  const double alpha = 0.25 + 0.75 * unresolved;
  const double beta = -0.25 * (1 - unresolved);
  const double resistance = effort.damping + alpha * dt * effort.stiffness;
  if (!(resistance * dt >= kFelt)) return false;
  row.compliance = 1 / (resistance * dt);
  row.velocity = (effort.stiffness * (effort.way - beta * dt * effort.rate) +
                  effort.damping * effort.wanted_rate + effort.effort) /
                 resistance;
  return true;
}

// Takes held rows out one after the other, each of those after it, too (Gram and Schmidt's method in the
// metric of the inverse masses): what is left of the row is what moves.
double mobility_of(const JointRow& row, std::span<const JointRow> held, const JointStep& step) {
  // The share of its square that is left of a row which follows from others.
  constexpr double kSquareLeft = 1e-12;
  std::array<RowNumbers, kHeldRowsMax> rows;
  std::array<RowNumbers, kHeldRowsMax> responses;
  invariant(held.size() <= kHeldRowsMax, "a joint holds no more than six numbers");
  const auto take_out = [&](std::size_t count, RowNumbers& numbers, RowNumbers& response) {
    double square = numbers.dot(response);
    for (std::size_t k = 0; k < count; ++k) {
      const double share = responses[k].dot(numbers);
      numbers -= rows[k] * share;
      response -= responses[k] * share;
      square -= share * share;
    }
    return square;
  };
  for (std::size_t n = 0; n < held.size(); ++n) {
    rows[n] = numbers_of(held[n]);
    responses[n] = response_to(rows[n], step);
    const double whole = rows[n].dot(responses[n]);
    const double left = take_out(n, rows[n], responses[n]);
    const double scale = left > whole * kSquareLeft ? 1 / std::sqrt(left) : 0;
    rows[n] *= scale;
    responses[n] *= scale;
  }
  RowNumbers numbers = numbers_of(row);
  RowNumbers response = response_to(numbers, step);
  return std::max(take_out(held.size(), numbers, response), 0.0);
}

}  // namespace tessera::joints
