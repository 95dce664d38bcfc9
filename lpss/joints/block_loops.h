// Defines what a BlockKernel does. All is local to the file that includes this one: files are compiled for
// different processors.
#pragma once

#include "lpss/joints/block_kernel.h"

namespace tessera::joints {
namespace {

// So many numbers at once; where the processor has no such lanes, the compiler makes several of it. In memory
// they may lie anywhere: as members of a packed struct, since not every compiler remembers an alignment that
// is less than usual behind a reference.
template <int kLanes>
struct Numbers {
  typedef double Type __attribute__((vector_size(kLanes * sizeof(double))));
  struct __attribute__((packed, may_alias)) Loose {
    Type all;
  };
};
template <>
struct Numbers<1> {
  typedef double Type;
  struct __attribute__((packed, may_alias)) Loose {
    Type all;
  };
};

template <int kLanes>
inline typename Numbers<kLanes>::Loose& numbers_at(double* first) {
  return *reinterpret_cast<typename Numbers<kLanes>::Loose*>(first);
}
template <int kLanes>
inline const typename Numbers<kLanes>::Loose& numbers_at(const double* first) {
  return *reinterpret_cast<const typename Numbers<kLanes>::Loose*>(first);
}

// Four rows, or four sides of one.
constexpr int kWide = 4;
static_assert(kTile == kWide && kSidesAtOnce == kWide);
using Wide = Numbers<kWide>::Type;

inline Numbers<kWide>::Loose& wide(double* first) { return numbers_at<kWide>(first); }
inline const Numbers<kWide>::Loose& wide(const double* first) { return numbers_at<kWide>(first); }

// Rows at once: as many as there are lanes for; of a tile, as many as there are registers for.
#if defined(__AVX512F__)
constexpr int kWidest = 8;
constexpr int kRowsOfTile = 2 * kWidest;
#elif defined(__AVX2__)
constexpr int kWidest = kWide;
constexpr int kRowsOfTile = 2 * kWidest;
#else
constexpr int kWidest = kWide;
constexpr int kRowsOfTile = kWidest;
#endif

template <int kCount>
struct Rows {
  static constexpr int kLanes = kCount;
};

// Calls `act` with a row and with how many it is to do at once, as Rows, for all rows from `first` on.
template <typename Act>
inline void for_rows(int first, int count, Act act) {
  int row = first;
  for (; row + kWidest <= count; row += kWidest) act(row, Rows<kWidest>());
  if (kWidest > kWide && row + kWide <= count) {
    act(row, Rows<kWide>());
    row += kWide;
  }
  for (; row < count; ++row) act(row, Rows<1>());
}

// Column by column.
template <typename Number>
struct Panel {
  Number* numbers;
  std::ptrdiff_t rows;

  Panel(const FrontShape& front, Number* first) : numbers(first), rows(front.pivots + front.below) {}
  Number* column(int n) const { return numbers + n * rows; }
};

// y += x
inline void add(double* y, const double* x, int count) {
  for_rows(0, count, [&](int n, auto rows) {
    numbers_at<rows.kLanes>(y + n).all += numbers_at<rows.kLanes>(x + n).all;
  });
}

void assemble(const FrontShape& front, const ChildShape& child, const double* left, double* numbers,
              double* update) {
  const Panel<double> panel(front, numbers);
  for (int r = 0; r < child.runs_count; ++r) {
    for (int n = 0; n < child.runs[r].count; ++n) {
      const int column = child.runs[r].to + n;
      const std::ptrdiff_t filled = column - front.pivots;
      double* const into = filled < 0 ? panel.column(column) : update + filled * front.below - front.pivots;
      const double* const from = left + static_cast<std::ptrdiff_t>(child.runs[r].from + n) * child.below;
      add(into + column, from + child.runs[r].from + n, child.runs[r].count - n);
      for (int q = r + 1; q < child.runs_count; ++q)
        add(into + child.runs[q].to, from + child.runs[q].from, child.runs[q].count);
    }
  }
}

// target -= left * right, of kRows rows and kColumns columns; `right` has kTile numbers a column of `left`.
template <int kLanes, int kRows, int kColumns>
inline void subtract_tile(double* target, std::ptrdiff_t target_rows, const double* left,
                          std::ptrdiff_t left_rows, const double* right, int count) {
  typename Numbers<kLanes>::Type sum[kColumns][kRows / kLanes] = {};
  for (int k = 0; k < count; ++k) {
#pragma GCC unroll 4
    for (int c = 0; c < kColumns; ++c) {
#pragma GCC unroll 2
      for (int n = 0; n < kRows / kLanes; ++n)
        sum[c][n] += numbers_at<kLanes>(left + k * left_rows + n * kLanes).all * right[k * kTile + c];
    }
  }
#pragma GCC unroll 4
  for (int c = 0; c < kColumns; ++c) {
#pragma GCC unroll 2
    for (int n = 0; n < kRows / kLanes; ++n)
      numbers_at<kLanes>(target + c * target_rows + n * kLanes).all -= sum[c][n];
  }
}

template <int kColumns>
void subtract_columns(double* target, std::ptrdiff_t target_rows, int rows, const double* left,
                      std::ptrdiff_t left_rows, const double* right, int count) {
  int row = 0;
  for (; row + kRowsOfTile <= rows; row += kRowsOfTile) {
    subtract_tile<kWidest, kRowsOfTile, kColumns>(target + row, target_rows, left + row, left_rows, right,
                                                  count);
  }
  for_rows(row, rows, [&](int at, auto at_once) {
    constexpr int kRows = at_once.kLanes;
    subtract_tile<kRows, kRows, kColumns>(target + at, target_rows, left + at, left_rows, right, count);
  });
}

// Subtracts the products of `count` columns of a panel from `columns` (at most kTile) columns of `target`,
// whose rows are those of the panel from `first` on.
void subtract(double* target, std::ptrdiff_t target_rows, int columns, const Panel<double>& panel, int first,
              int count, const double* right) {
  const double* const left = panel.numbers + first;
  const int rows = static_cast<int>(panel.rows) - first;
  switch (columns) {
    case 1:
      return subtract_columns<1>(target, target_rows, rows, left, panel.rows, right, count);
    case 2:
      return subtract_columns<2>(target, target_rows, rows, left, panel.rows, right, count);
    case 3:
      return subtract_columns<3>(target, target_rows, rows, left, panel.rows, right, count);
    default:
      return subtract_columns<kTile>(target, target_rows, rows, left, panel.rows, right, count);
  }
}

// Rows `first` to `first + columns` of the first `count` columns of L D, row by column.
void weigh(const Panel<double>& panel, const double* pivots, int first, int columns, int count,
           double* right) {
  for (int k = 0; k < count; ++k) {
    for (int c = 0; c < columns; ++c) right[k * kTile + c] = pivots[k] * panel.column(k)[first + c];
  }
}

// y -= x * factor
inline void subtract_product(double* y, const double* x, double factor, int count) {
  for_rows(0, count, [&](int n, auto rows) {
    numbers_at<rows.kLanes>(y + n).all -= numbers_at<rows.kLanes>(x + n).all * factor;
  });
}

// Of a panel's columns `first` to `first + columns`, from which those before are subtracted.
bool eliminate(const Panel<double>& panel, int first, int columns, double* pivots) {
  const int rows = static_cast<int>(panel.rows);
  for (int k = first; k < first + columns; ++k) {
    double* const column = panel.column(k);
    const double pivot = column[k];
    pivots[k] = pivot;
    if (pivot == 0 || !__builtin_isfinite(pivot)) return false;
    for_rows(k + 1, rows,
             [&](int row, auto at_once) { numbers_at<at_once.kLanes>(column + row).all /= pivot; });
    for (int next = k + 1; next < first + columns; ++next)
      subtract_product(panel.column(next) + next, column + next, pivot * column[next], rows - next);
  }
  return true;
}

inline int columns_of_tile(int first, int count) { return count - first < kTile ? count - first : kTile; }

bool factorise(const FrontShape& front, double* numbers, double* pivots, double* update, double* weighed) {
  const Panel<double> panel(front, numbers);
  for (int first = 0; first < front.pivots; first += kTile) {
    const int columns = columns_of_tile(first, front.pivots);
    weigh(panel, pivots, first, columns, first, weighed);
    subtract(panel.column(first) + first, panel.rows, columns, panel, first, first, weighed);
    if (!eliminate(panel, first, columns, pivots)) return false;
  }
  for (int first = 0; first < front.below; first += kTile) {
    const int columns = columns_of_tile(first, front.below);
    weigh(panel, pivots, front.pivots + first, columns, front.pivots, weighed);
    subtract(update + (static_cast<std::ptrdiff_t>(front.below) + 1) * first, front.below, columns, panel,
             front.pivots + first, front.pivots, weighed);
  }
  return true;
}

void forward(const FrontShape& front, const double* numbers, double* own, double* x, double* held) {
  const Panel<const double> panel(front, numbers);
  for (int n = 0; n < front.below; ++n) held[n] = x[front.below_rows[n]];
  for (int k = 0; k < front.pivots; ++k) {
    const double* const column = panel.column(k);
    subtract_product(own + k + 1, column + k + 1, own[k], front.pivots - k - 1);
    subtract_product(held, column + front.pivots, own[k], front.below);
  }
  for (int n = 0; n < front.below; ++n) x[front.below_rows[n]] = held[n];
}

void forward_sides(const FrontShape& front, const double* numbers, double* own, double* x) {
  const Panel<const double> panel(front, numbers);
  for (int k = 0; k < front.pivots; ++k) {
    const double* const column = panel.column(k);
    const Wide pivot = wide(own + k * kWide).all;
    for (int row = k + 1; row < front.pivots; ++row) wide(own + row * kWide).all -= pivot * column[row];
  }
  for (int n = 0; n < front.below; ++n) {
    double* const row = x + front.below_rows[n] * kWide;
    const double* const factors = panel.numbers + front.pivots + n;
    Wide sum = wide(row).all;
    for (int k = 0; k < front.pivots; ++k) sum -= wide(own + k * kWide).all * factors[k * panel.rows];
    wide(row).all = sum;
  }
}

// The sums of so many pivots over what is below grow at once; each adds up row by row.
constexpr int kSumsAtOnce = 4;

template <int kSums>
inline void backward(const FrontShape& front, const Panel<const double>& panel, int last, double* own,
                     const double* held) {
  double sums[kSums] = {};
  for (int n = 0; n < front.below; ++n) {
#pragma GCC unroll 4
    for (int s = 0; s < kSums; ++s) sums[s] += panel.column(last - s)[front.pivots + n] * held[n];
  }
#pragma GCC unroll 4
  for (int s = 0; s < kSums; ++s) {
    const int k = last - s;
    for (int row = k + 1; row < front.pivots; ++row) sums[s] += panel.column(k)[row] * own[row];
    own[k] -= sums[s];
  }
}

void backward(const FrontShape& front, const double* numbers, double* own, const double* x, double* held) {
  const Panel<const double> panel(front, numbers);
  for (int n = 0; n < front.below; ++n) held[n] = x[front.below_rows[n]];
  int last = front.pivots - 1;
  for (; last + 1 >= kSumsAtOnce; last -= kSumsAtOnce) backward<kSumsAtOnce>(front, panel, last, own, held);
  for (; last >= 0; --last) backward<1>(front, panel, last, own, held);
}

template <int kSums>
inline void backward_sides(const FrontShape& front, const Panel<const double>& panel, int last, double* own,
                           const double* x) {
  Wide sums[kSums] = {};
  for (int n = 0; n < front.below; ++n) {
    const Wide held = wide(x + front.below_rows[n] * kWide).all;
#pragma GCC unroll 4
    for (int s = 0; s < kSums; ++s) sums[s] += held * panel.column(last - s)[front.pivots + n];
  }
#pragma GCC unroll 4
  for (int s = 0; s < kSums; ++s) {
    const int k = last - s;
    for (int row = k + 1; row < front.pivots; ++row)
      sums[s] += wide(own + row * kWide).all * panel.column(k)[row];
    wide(own + k * kWide).all -= sums[s];
  }
}

void backward_sides(const FrontShape& front, const double* numbers, double* own, const double* x) {
  const Panel<const double> panel(front, numbers);
  int last = front.pivots - 1;
  for (; last + 1 >= kSumsAtOnce; last -= kSumsAtOnce)
    backward_sides<kSumsAtOnce>(front, panel, last, own, x);
  for (; last >= 0; --last) backward_sides<1>(front, panel, last, own, x);
}

void divide_sides(const double* pivots, int rows, double* x) {
  for (int n = 0; n < rows; ++n) wide(x + n * kWide).all /= pivots[n];
}

void add_rates_of_sides(const double* rows, int count, const double* velocities, double* rates) {
  Wide velocity[kBodyNumbers];
#pragma GCC unroll 6
  for (int n = 0; n < kBodyNumbers; ++n) velocity[n] = wide(velocities + n * kWide).all;
  for (int row = 0; row < count; ++row) {
    const double* const numbers = rows + row * kBodyNumbers;
    Wide rate = velocity[0] * numbers[0];
#pragma GCC unroll 5
    for (int n = 1; n < kBodyNumbers; ++n) rate += velocity[n] * numbers[n];
    wide(rates + row * kWide).all += rate;
  }
}

void add_combined_of_sides(const double* rows, int count, const double* of_rows, double* sums) {
  Wide sum[kBodyNumbers];
#pragma GCC unroll 6
  for (int n = 0; n < kBodyNumbers; ++n) sum[n] = wide(sums + n * kWide).all;
  for (int row = 0; row < count; ++row) {
    const Wide of_row = wide(of_rows + row * kWide).all;
#pragma GCC unroll 6
    for (int n = 0; n < kBodyNumbers; ++n) sum[n] += of_row * rows[row * kBodyNumbers + n];
  }
#pragma GCC unroll 6
  for (int n = 0; n < kBodyNumbers; ++n) wide(sums + n * kWide).all = sum[n];
}

constexpr BlockKernel kLoops = {assemble,     factorise,          forward,
                                backward,     forward_sides,      backward_sides,
                                divide_sides, add_rates_of_sides, add_combined_of_sides};

}  // namespace
}  // namespace tessera::joints
