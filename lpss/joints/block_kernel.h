// The inner loops of BlockFactors and HeldRows, compiled for different processors: each does the same
// operations in the same order, so that the bits are the same on all. Without Eigen and without the standard
// library: what is inline there would be compiled for one processor and might be called on another.
#pragma once

#include <cstddef>

namespace tessera::joints {

inline constexpr int kBodyNumbers = 6;  // of a body's velocities: linear, angular

// So many right-hand sides are solved at once.
inline constexpr int kSidesAtOnce = 4;

// A dense front, whose panel has columns of its pivots, of pivots + below numbers each.
struct FrontShape {
  int pivots;
  int below;
  const int* below_rows;  // of all, in the order of elimination
};

// Rows below the pivots of a front, counted from the first of them, that are consecutive in its parent's,
// too.
struct RowRun {
  int from;
  int to;  // counted from the parent's first pivot
  int count;
};

// A front that has left numbers to its parent: the lower half of a square of `below`.
struct ChildShape {
  int below;
  const RowRun* runs;  // ascending
  int runs_count;
};

struct BlockKernel {
  // Adds what a child has left to the columns of the front's panel and of its `update` (of below x below
  // numbers), to the lower half of both.
  void (*assemble)(const FrontShape& front, const ChildShape& child, const double* left, double* panel,
                   double* update);

  // Factorises the panel in place, writes its pivots, and subtracts from the lower half of `update`, and
  // from what is beside it in tiles of the diagonal, what these fill. `weighed` has room for kTile numbers a
  // pivot. False if a pivot is 0 or not a number.
  bool (*factorise)(const FrontShape& front, double* panel, double* pivots, double* update, double* weighed);

  // `x` has the rows of all, `own` those of the front's pivots; `held` has room for all that are below.
  void (*forward)(const FrontShape& front, const double* panel, double* own, double* x, double* held);
  void (*backward)(const FrontShape& front, const double* panel, double* own, const double* x, double* held);

  // The same with kSidesAtOnce numbers a row. Each side has the bits that it has alone.
  void (*forward_sides)(const FrontShape& front, const double* panel, double* own, double* x);
  void (*backward_sides)(const FrontShape& front, const double* panel, double* own, const double* x);

  // x / pivots, row by row.
  void (*divide_sides)(const double* pivots, int rows, double* x);

  // Of `count` rows of kBodyNumbers numbers over the velocities of a body: adds rows * velocities, and
  // rows^T * of_rows.
  void (*add_rates_of_sides)(const double* rows, int count, const double* velocities, double* rates);
  void (*add_combined_of_sides)(const double* rows, int count, const double* of_rows, double* sums);
};

inline constexpr int kTile = 4;  // columns that are eliminated at once

extern const BlockKernel kBlockKernelBaseline;  // for every processor of the architecture
#if defined(__x86_64__)
extern const BlockKernel kBlockKernelAvx2;
extern const BlockKernel kBlockKernelAvx512;
#endif

}  // namespace tessera::joints
