#include "lpss/joints/soft_row.h"

#include <Eigen/Cholesky>
#include <algorithm>

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
  numbers << row.linear, row.angular_child, -row.linear, -row.angular_parent;
  return numbers;
}

RowNumbers response_to(const RowNumbers& impulse, const JointStep& step) {
  RowNumbers response;
  response << step.child.inverse_mass * impulse.segment<3>(0),
      step.child.inverse_inertia * impulse.segment<3>(3), step.parent.inverse_mass * impulse.segment<3>(6),
      step.parent.inverse_inertia * impulse.segment<3>(9);
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

double mobility_of(const JointRow& row, std::span<const JointRow> held, const JointStep& step) {
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;
  const RowNumbers numbers = numbers_of(row);
  const RowNumbers response = response_to(numbers, step);
  const auto count = static_cast<Eigen::Index>(held.size());
  Matrix matrix(count, count);
  Vector shared(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const RowNumbers other = numbers_of(held[static_cast<std::size_t>(i)]);
    const RowNumbers other_response = response_to(other, step);
    shared[i] = other.dot(response);
    for (Eigen::Index j = 0; j < count; ++j)
      matrix(i, j) = numbers_of(held[static_cast<std::size_t>(j)]).dot(other_response);
  }
  return std::max(numbers.dot(response) - shared.dot(matrix.ldlt().solve(shared)), 0.0);
}

}  // namespace tessera::joints
