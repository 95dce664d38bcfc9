#include "lpss/joints/block_factors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace tessera::joints {
namespace {

// Two rows; the compiler joins these where the processor has wider lanes.
typedef double Lanes __attribute__((vector_size(16), may_alias, aligned(8)));
constexpr int kLanes = 2;
constexpr int kTile = 4;  // rows and columns that are computed at once

struct Panel {
  double* numbers;  // column by column
  int rows;

  double* column(int n) const { return numbers + static_cast<std::ptrdiff_t>(n) * rows; }
};

// target -= left * right, of kTile rows and columns; `right` has kTile numbers a column of `left`.
inline void subtract_tile(double* target, std::ptrdiff_t target_rows, const double* left,
                          std::ptrdiff_t left_rows, const double* right, int count) {
  Lanes sum[kTile][kTile / kLanes] = {};
  for (int k = 0; k < count; ++k) {
    const Lanes* rows = reinterpret_cast<const Lanes*>(left + k * left_rows);
    for (int c = 0; c < kTile; ++c) {
      for (int lane = 0; lane < kTile / kLanes; ++lane) sum[c][lane] += rows[lane] * right[k * kTile + c];
    }
  }
  for (int c = 0; c < kTile; ++c) {
    Lanes* rows = reinterpret_cast<Lanes*>(target + c * target_rows);
    for (int lane = 0; lane < kTile / kLanes; ++lane) rows[lane] -= sum[c][lane];
  }
}

// The same for fewer rows and columns.
inline void subtract_rest(double* target, std::ptrdiff_t target_rows, int rows, int columns,
                          const double* left, std::ptrdiff_t left_rows, const double* right, int count) {
  for (int c = 0; c < columns; ++c) {
    for (int row = 0; row < rows; ++row) {
      double sum = 0;
      for (int k = 0; k < count; ++k) sum += left[k * left_rows + row] * right[k * kTile + c];
      target[c * target_rows + row] -= sum;
    }
  }
}

// Subtracts the products of `count` columns of a panel from `columns` (at most kTile) columns of `target`,
// whose rows are those of the panel from `first` on.
void subtract(double* target, std::ptrdiff_t target_rows, int columns, const Panel& panel, int first,
              int count, const double* right) {
  int row = first;
  if (columns == kTile) {
    for (; row + kTile <= panel.rows; row += kTile) {
      subtract_tile(target + (row - first), target_rows, panel.numbers + row, panel.rows, right, count);
    }
  }
  subtract_rest(target + (row - first), target_rows, panel.rows - row, columns, panel.numbers + row,
                panel.rows, right, count);
}

// Rows `first` to `first + columns` of the first `count` columns of L D, row by column.
void weigh(const Panel& panel, const double* pivots, int first, int columns, int count,
           std::vector<double>& right) {
  right.assign(static_cast<std::size_t>(count * kTile), 0.0);
  for (int k = 0; k < count; ++k) {
    for (int c = 0; c < columns; ++c)
      right[static_cast<std::size_t>(k * kTile + c)] = pivots[k] * panel.column(k)[first + c];
  }
}

// Of a panel's columns `first` to `first + columns`, from which those before are subtracted. False if one is
// 0.
bool eliminate(const Panel& panel, int first, int columns, double* pivots) {
  for (int k = first; k < first + columns; ++k) {
    double* const column = panel.column(k);
    const double pivot = column[k];
    pivots[k] = pivot;
    if (pivot == 0 || !std::isfinite(pivot)) return false;
    for (int row = k + 1; row < panel.rows; ++row) column[row] /= pivot;
    for (int next = k + 1; next < first + columns; ++next) {
      const double weighed = pivot * column[next];
      double* const target = panel.column(next);
      for (int row = next; row < panel.rows; ++row) target[row] -= column[row] * weighed;
    }
  }
  return true;
}

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
  const Panel panel{numbers, kRows};
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

// Solves a system of a single front of kRows rows, in the order of solve_fronts().
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

}  // namespace

void BlockFactors::set_pattern(std::shared_ptr<const BlockPattern> pattern) {
  pattern_ = std::move(pattern);
  pivots_.resize(static_cast<std::size_t>(pattern_->rows()));
  ordered_.resize(static_cast<std::size_t>(pattern_->rows()));
  updates_.resize(pattern_->updates_size());
  update_.resize(pattern_->update_max());
}

void BlockFactors::clear() { panels_.assign(pattern_->panels_size(), 0.0); }

// Adds what children have left.
void BlockFactors::assemble(const BlockPattern::Front& front) {
  const int rows = front.rows();
  const int below = front.below_count();
  std::fill_n(update_.begin(), static_cast<std::ptrdiff_t>(below) * below, 0.0);
  for (const int c : front.children) {
    const BlockPattern::Front& child = pattern_->fronts()[static_cast<std::size_t>(c)];
    const double* const left = updates_.data() + child.update;
    for (std::size_t r = 0; r < child.runs.size(); ++r) {
      for (int n = 0; n < child.runs[r].count; ++n) {
        const int column = child.runs[r].to + n;
        const bool is_pivot = column < front.pivots;
        double* const into =
            is_pivot ? panels_.data() + front.panel + static_cast<std::ptrdiff_t>(column) * rows
                     : update_.data() + static_cast<std::ptrdiff_t>(column - front.pivots) * below;
        const int above = is_pivot ? 0 : front.pivots;
        const double* const from =
            left + static_cast<std::ptrdiff_t>(child.runs[r].from + n) * child.below_count();
        for (std::size_t q = r; q < child.runs.size(); ++q) {
          const BlockPattern::Run& run = child.runs[q];
          for (int row = q == r ? n : 0; row < run.count; ++row)
            into[run.to - above + row] += from[run.from + row];
        }
      }
    }
  }
}

bool BlockFactors::is_unrolled() const {
  return pattern_->fronts().size() == 1 && pattern_->rows() <= kUnrolledMax;
}

bool BlockFactors::factorise() {
  if (is_unrolled()) return kFactoriseFront[pivots_.size()](panels_.data(), pivots_.data());
  for (const BlockPattern::Front& front : pattern_->fronts()) {
    assemble(front);
    const Panel panel{panels_.data() + front.panel, front.rows()};
    double* const pivots = pivots_.data() + front.first;
    for (int first = 0; first < front.pivots; first += kTile) {
      const int columns = std::min(kTile, front.pivots - first);
      weigh(panel, pivots, first, columns, first, weighed_);
      subtract(panel.column(first) + first, panel.rows, columns, panel, first, first, weighed_.data());
      if (!eliminate(panel, first, columns, pivots)) return false;
    }
    const int below = front.below_count();
    for (int first = 0; first < below; first += kTile) {
      const int columns = std::min(kTile, below - first);
      weigh(panel, pivots, front.pivots + first, columns, front.pivots, weighed_);
      subtract(update_.data() + static_cast<std::ptrdiff_t>(first) * below + first, below, columns, panel,
               front.pivots + first, front.pivots, weighed_.data());
    }
    std::copy_n(update_.begin(), static_cast<std::ptrdiff_t>(below) * below,
                updates_.begin() + static_cast<std::ptrdiff_t>(front.update));
  }
  return true;
}

void BlockFactors::solve(const Eigen::VectorXd& right, Eigen::VectorXd& solution) const {
  const std::vector<int>& order = pattern_->row_order();
  for (std::size_t n = 0; n < order.size(); ++n) ordered_[n] = right[order[n]];
  if (is_unrolled()) {
    kSolveFront[order.size()](panels_.data(), pivots_.data(), ordered_.data());
  } else {
    solve_fronts();
  }
  solution.resize(right.size());
  for (std::size_t n = 0; n < order.size(); ++n) solution[order[n]] = ordered_[n];
}

void BlockFactors::solve_fronts() const {
  for (const BlockPattern::Front& front : pattern_->fronts()) {
    const int rows = front.rows();
    double* const x = ordered_.data() + front.first;
    for (int k = 0; k < front.pivots; ++k) {
      const double* const column = panels_.data() + front.panel + static_cast<std::ptrdiff_t>(k) * rows;
      for (int row = k + 1; row < front.pivots; ++row) x[row] -= column[row] * x[k];
      for (int n = 0; n < front.below_count(); ++n)
        ordered_[static_cast<std::size_t>(front.below[static_cast<std::size_t>(n)])] -=
            column[front.pivots + n] * x[k];
    }
  }
  for (std::size_t n = 0; n < ordered_.size(); ++n) ordered_[n] /= pivots_[n];
  for (std::size_t f = pattern_->fronts().size(); f-- > 0;) {
    const BlockPattern::Front& front = pattern_->fronts()[f];
    const int rows = front.rows();
    double* const x = ordered_.data() + front.first;
    for (int k = front.pivots; k-- > 0;) {
      const double* const column = panels_.data() + front.panel + static_cast<std::ptrdiff_t>(k) * rows;
      double sum = 0;
      for (int row = k + 1; row < front.pivots; ++row) sum += column[row] * x[row];
      for (int n = 0; n < front.below_count(); ++n)
        sum += column[front.pivots + n] *
               ordered_[static_cast<std::size_t>(front.below[static_cast<std::size_t>(n)])];
      x[k] -= sum;
    }
  }
}

}  // namespace tessera::joints
