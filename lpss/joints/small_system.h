// Small dense symmetric systems, of which some rows may follow from others.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace tessera::joints {

// A x = b, with A positive semidefinite: by Cholesky's factors. A row that follows from those before it, up
// to rounding, is left out: its x is 0. Keeps its storage.
class SmallSystem {
 public:
  // Of the rows and columns `chosen` of a matrix, ascending.
  template <typename Matrix>
  void factorise(const Matrix& matrix, std::span<const int> chosen) {
    size_ = static_cast<int>(chosen.size());
    factors_.resize(static_cast<std::size_t>(size_ * size_));
    for (int row = 0; row < size_; ++row) {
      for (int column = 0; column <= row; ++column) at(row, column) = matrix(chosen[row], chosen[column]);
    }
    factorise();
  }

  // In place.
  void solve(std::span<double> x) const;

  int size() const { return size_; }

 private:
  void factorise();
  double& at(int row, int column) { return factors_[static_cast<std::size_t>(row * size_ + column)]; }
  double at(int row, int column) const { return factors_[static_cast<std::size_t>(row * size_ + column)]; }

  int size_ = 0;
  std::vector<double> factors_;  // row by row; of the diagonal, the inverses
};

}  // namespace tessera::joints
