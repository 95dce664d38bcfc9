// The factors of a symmetric positive definite matrix of blocks: L D L^T.
//
// Sums run in an order that depends on the pattern alone, and lanes hold different rows, so that the bits are
// the same on every processor.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "lpss/joints/block_kernel.h"
#include "lpss/joints/block_pattern.h"

namespace tessera::joints {

// Those that this processor can run; the last one is the fastest.
std::span<const BlockKernel* const> block_kernels();

// Several vectors at once, side by side.
using Sides = Eigen::Matrix<double, Eigen::Dynamic, kSidesAtOnce, Eigen::RowMajor>;

class BlockFactors {
 public:
  explicit BlockFactors(const BlockKernel& kernel = *block_kernels().back());

  void set_pattern(std::shared_ptr<const BlockPattern> pattern);

  // Begins a matrix of zeros.
  void clear();

  // A block of it, to be written: the lower half of a diagonal one suffices.
  using Block = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
  Block block(const BlockPattern::Place& place, int rows, int columns) {
    return {panels_.data() + place.first, rows, columns, Eigen::OuterStride<>(place.stride)};
  }

  // In place of the matrix. False if it is singular, or not of finite numbers.
  bool factorise();

  // `solution` is another vector, of any size before.
  void solve(const Eigen::VectorXd& right, Eigen::VectorXd& solution) const;
  void solve(const Sides& right, Sides& solution) const;  // each side has the bits that it has alone

 private:
  bool is_unrolled() const;

  const BlockKernel* kernel_;
  std::shared_ptr<const BlockPattern> pattern_;
  std::vector<double> panels_;           // the matrix, then L without its diagonal of ones, by front
  std::vector<double> pivots_;           // D, in the order of elimination
  std::vector<double> updates_;          // what fronts leave to their parents
  std::vector<double> weighed_;          // columns of L D of a front, transposed
  mutable std::vector<double> ordered_;  // what is solved, in the order of elimination
  mutable std::vector<double> ordered_sides_;
  mutable std::vector<double> below_;  // of it, what is below the pivots of a front
};

}  // namespace tessera::joints
