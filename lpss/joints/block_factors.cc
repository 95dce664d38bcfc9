#include "lpss/joints/block_factors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <ranges>
#include <utility>

namespace tessera::joints {
namespace {

struct Columns {
  double* numbers;  // column by column
  int rows;

  double* column(int n) const { return numbers + static_cast<std::ptrdiff_t>(n) * rows; }
};

// Calls `act` with the constants from 0 to kCount: loops in loops, which the compiler does not unroll by
// itself.
template <int kCount, typename Act>
inline void unrolled(Act act) {
  [&]<int... kN>(std::integer_sequence<int, kN...>) { (act(std::integral_constant<int, kN>()), ...); }
  (std::make_integer_sequence<int, kCount>());
}

// Factorises a system of a single front of kRows rows. Each number is changed in the order of factorise(): by
// the columns before its tile at once, then by those of its tile.
template <int kRows>
bool factorise_front(double* numbers, double* pivots) {
  const Columns panel{numbers, kRows};
  bool is_regular = true;
  unrolled<kRows>([&](auto c) {
    constexpr int first = c / kTile * kTile;
    double* const target = panel.column(c);
    for (int row = c; first > 0 && row < kRows; ++row) {
      double sum = 0;
      for (int k = 0; k < first; ++k) sum += panel.column(k)[row] * (pivots[k] * panel.column(k)[c]);
      target[row] -= sum;
    }
    for (int k = first; k < c; ++k) {
      const double weighed = pivots[k] * panel.column(k)[c];
      for (int row = c; row < kRows; ++row) target[row] -= panel.column(k)[row] * weighed;
    }
    const double pivot = pivots[c] = target[c];
    if (pivot == 0 || !std::isfinite(pivot)) is_regular = false;
    for (int row = c + 1; row < kRows; ++row) target[row] /= pivot;
  });
  return is_regular;
}

// Solves a system of a single front of kRows rows, in the order of the kernel.
template <int kRows>
void solve_front(const double* panel, const double* pivots, double* x) {
  double y[kRows + 1];  // in registers
  std::copy_n(x, kRows, y);
  unrolled<kRows>([&](auto k) {
    for (int row = k + 1; row < kRows; ++row) y[row] -= panel[k * kRows + row] * y[k];
  });
  for (int k = 0; k < kRows; ++k) y[k] /= pivots[k];
  unrolled<kRows>([&](auto n) {
    constexpr int k = kRows - 1 - n;
    double sum = 0;
    for (int row = k + 1; row < kRows; ++row) sum += panel[k * kRows + row] * y[row];
    y[k] -= sum;
  });
  std::copy_n(y, kRows, x);
}

constexpr int kUnrolledMax = 12;

template <int... kRows>
constexpr auto factorisers(std::integer_sequence<int, kRows...>) {
  return std::array{&factorise_front<kRows>...};
}
template <int... kRows>
constexpr auto solvers(std::integer_sequence<int, kRows...>) {
  return std::array{&solve_front<kRows>...};
}

// By the number of rows.
constexpr auto kFactoriseFront = factorisers(std::make_integer_sequence<int, kUnrolledMax + 1>());
constexpr auto kSolveFront = solvers(std::make_integer_sequence<int, kUnrolledMax + 1>());

FrontShape shape_of(const BlockPattern::Front& front) {
  return {front.pivots, front.below_count(), front.below.data()};
}

ChildShape child_shape_of(const BlockPattern::Front& front) {
  return {front.below_count(), front.runs.data(), static_cast<int>(front.runs.size())};
}

// The lower half, and what is beside it in tiles of the diagonal.
void clear_update(double* update, int below) {
  for (int column = 0; column < below; ++column) {
    const int first = column / kTile * kTile;
    std::fill_n(update + static_cast<std::ptrdiff_t>(column) * below + first, below - first, 0.0);
  }
}

}  // namespace

#if defined(__x86_64__)
std::span<const BlockKernel* const> block_kernels() {
  static constexpr std::array kAll = {&kBlockKernelBaseline, &kBlockKernelAvx2, &kBlockKernelAvx512};
  // The first processors with AVX-512 slow their clock for it; those with VBMI2 came later.
  static const std::size_t count = []() -> std::size_t {
    if (!__builtin_cpu_supports("avx2")) return 1;
    return __builtin_cpu_supports("avx512vbmi2") ? 3 : 2;
  }();
  return std::span(kAll).first(count);
}
#else
std::span<const BlockKernel* const> block_kernels() {
  static constexpr std::array kAll = {&kBlockKernelBaseline};
  return kAll;
}
#endif

BlockFactors::BlockFactors(const BlockKernel& kernel) : kernel_(&kernel) {}

void BlockFactors::set_pattern(std::shared_ptr<const BlockPattern> pattern) {
  pattern_ = std::move(pattern);
  const auto rows = static_cast<std::size_t>(pattern_->rows());
  std::size_t pivots_max = 0;
  std::size_t below_max = 0;
  for (const BlockPattern::Front& front : pattern_->fronts()) {
    pivots_max = std::max(pivots_max, static_cast<std::size_t>(front.pivots));
    below_max = std::max(below_max, front.below.size());
  }
  pivots_.resize(rows);
  ordered_.resize(rows);
  ordered_sides_.resize(rows * kSidesAtOnce);
  below_.resize(below_max);
  weighed_.resize(pivots_max * kTile);
  updates_.resize(pattern_->updates_size());
}

void BlockFactors::clear() { panels_.assign(pattern_->panels_size(), 0.0); }

bool BlockFactors::is_unrolled() const {
  return pattern_->fronts().size() == 1 && pattern_->rows() <= kUnrolledMax;
}

bool BlockFactors::factorise() {
  if (is_unrolled()) return kFactoriseFront[pivots_.size()](panels_.data(), pivots_.data());
  for (const BlockPattern::Front& front : pattern_->fronts()) {
    const FrontShape shape = shape_of(front);
    double* const panel = panels_.data() + front.panel;
    double* const update = updates_.data() + front.update;
    clear_update(update, shape.below);
    for (const int c : front.children) {
      const BlockPattern::Front& child = pattern_->fronts()[static_cast<std::size_t>(c)];
      kernel_->assemble(shape, child_shape_of(child), updates_.data() + child.update, panel, update);
    }
    if (!kernel_->factorise(shape, panel, pivots_.data() + front.first, update, weighed_.data()))
      return false;
  }
  return true;
}

void BlockFactors::solve(const Eigen::VectorXd& right, Eigen::VectorXd& solution) const {
  const std::vector<int>& order = pattern_->row_order();
  double* const x = ordered_.data();
  for (std::size_t n = 0; n < order.size(); ++n) x[n] = right[order[n]];
  if (is_unrolled()) {
    kSolveFront[order.size()](panels_.data(), pivots_.data(), x);
  } else {
    for (const BlockPattern::Front& front : pattern_->fronts())
      kernel_->forward(shape_of(front), panels_.data() + front.panel, x + front.first, x, below_.data());
    for (std::size_t n = 0; n < order.size(); ++n) x[n] /= pivots_[n];
    for (const BlockPattern::Front& front : pattern_->fronts() | std::views::reverse)
      kernel_->backward(shape_of(front), panels_.data() + front.panel, x + front.first, x, below_.data());
  }
  solution.resize(right.size());
  for (std::size_t n = 0; n < order.size(); ++n) solution[order[n]] = x[n];
}

void BlockFactors::solve(const Sides& right, Sides& solution) const {
  const std::vector<int>& order = pattern_->row_order();
  double* const x = ordered_sides_.data();
  const auto side_rows = [](double* numbers) {
    return Eigen::Map<Eigen::Matrix<double, 1, kSidesAtOnce>>(numbers);
  };
  for (std::size_t n = 0; n < order.size(); ++n) side_rows(x + n * kSidesAtOnce) = right.row(order[n]);
  for (const BlockPattern::Front& front : pattern_->fronts())
    kernel_->forward_sides(shape_of(front), panels_.data() + front.panel, x + front.first * kSidesAtOnce, x);
  kernel_->divide_sides(pivots_.data(), pattern_->rows(), x);
  for (const BlockPattern::Front& front : pattern_->fronts() | std::views::reverse)
    kernel_->backward_sides(shape_of(front), panels_.data() + front.panel, x + front.first * kSidesAtOnce, x);
  solution.resize(right.rows(), kSidesAtOnce);
  for (std::size_t n = 0; n < order.size(); ++n) solution.row(order[n]) = side_rows(x + n * kSidesAtOnce);
}

}  // namespace tessera::joints
