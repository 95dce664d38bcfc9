#include "lpss/joints/small_system.h"

#include <cmath>

namespace tessera::joints {
namespace {

// The share of a diagonal number that is left of a row which does not follow from others.
constexpr double kLeft = 1e-9;

}  // namespace

void SmallSystem::factorise() {
  for (int row = 0; row < size_; ++row) {
    double diagonal = at(row, row);
    const double whole = diagonal;
    for (int column = 0; column < row; ++column) {
      double left = at(row, column);
      for (int k = 0; k < column; ++k) left -= at(row, k) * at(column, k);
      left *= at(column, column);
      at(row, column) = left;
      diagonal -= left * left;
    }
    at(row, row) = diagonal > whole * kLeft ? 1 / std::sqrt(diagonal) : 0;
  }
}

void SmallSystem::solve(std::span<double> x) const {
  const auto n = [](int k) { return static_cast<std::size_t>(k); };
  for (int row = 0; row < size_; ++row) {
    for (int k = 0; k < row; ++k) x[n(row)] -= at(row, k) * x[n(k)];
    x[n(row)] *= at(row, row);
  }
  for (int row = size_; row-- > 0;) {
    for (int k = row + 1; k < size_; ++k) x[n(row)] -= at(k, row) * x[n(k)];
    x[n(row)] *= at(row, row);
  }
}

}  // namespace tessera::joints
