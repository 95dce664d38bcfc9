// In which order the nodes of a sparse symmetric matrix of blocks are eliminated, and what fills in.
//
// Nodes whose elimination fills much the same rows are eliminated together, as the pivots of a dense front
// (Duff and Reid, The multifrontal solution of indefinite sparse symmetric linear equations, 1983).
#pragma once

#include <compare>
#include <cstddef>
#include <vector>

#include "lpss/joints/block_kernel.h"

namespace tessera::joints {

// Multiplications that a factorisation may take: some 0.2 s on one core, and a sheet of 80 by 80 bodies. The
// dense blocks that it fills have 1/3 n^3, so that 50 bodies that are all joined to each other are beyond it.
inline constexpr double kFactorWorkMax = 2e9;

class BlockPattern {
 public:
  // Two nodes whose block may have other numbers than 0, a < b.
  struct Edge {
    int a;
    int b;

    friend auto operator<=>(const Edge&, const Edge&) = default;
  };

  // Each comes after those whose parent it is.
  struct Front {
    int first = 0;             // row of all, in the order of elimination, of its first pivot
    int pivots = 0;            // rows
    std::vector<int> below;    // rows of all, in that order, that it fills: ascending
    std::vector<RowRun> runs;  // of these rows; none if it has no parent
    std::vector<int> children;
    std::size_t panel = 0;   // place of the columns of its pivots, of rows() numbers each
    std::size_t update = 0;  // place of what it leaves to its parent, until this has taken it

    int below_count() const { return static_cast<int>(below.size()); }
    int rows() const { return pivots + below_count(); }
  };

  // Where a block is, column by column.
  struct Place {
    std::size_t first = 0;
    int stride = 0;              // from column to column
    bool is_transposed = false;  // rows are those of the edge's b
  };

  // `sizes`: the rows of each node; `edges`: ascending, each once.
  BlockPattern(std::vector<int> sizes, std::vector<Edge> edges);

  bool is_of(const std::vector<int>& sizes, const std::vector<Edge>& edges) const {
    return sizes == sizes_ && edges == edges_;
  }

  // Whether it would be more work than kFactorWorkMax; there is nothing else in it then.
  bool is_too_large() const { return is_too_large_; }
  const std::vector<Front>& fronts() const { return fronts_; }
  const std::vector<int>& row_order() const { return row_order_; }  // by row in the order of elimination
  const Place& diagonal(std::size_t node) const { return diagonals_[node]; }
  const Place& block(std::size_t edge) const { return blocks_[edge]; }
  int rows() const { return static_cast<int>(row_order_.size()); }
  std::size_t panels_size() const { return panels_size_; }    // numbers of all panels
  std::size_t updates_size() const { return updates_size_; }  // numbers of all updates that are held at once

 private:
  using Rows = std::vector<std::vector<int>>;  // nodes, by their place in the order of elimination

  std::vector<int> order(const Rows& neighbours) const;
  // The later ones that each fills, ascending; until that is too much.
  Rows filled(const std::vector<int>& order, const Rows& neighbours);
  void make_fronts(const std::vector<int>& order, const Rows& below);
  void place_rows(const std::vector<int>& order);
  void place_updates();
  void place_blocks();

  const std::vector<int> sizes_;
  const std::vector<Edge> edges_;
  std::vector<Front> fronts_;
  std::vector<int> front_of_;   // by node
  std::vector<int> first_row_;  // in the order of elimination, by node
  std::vector<int> row_order_;
  std::vector<Place> diagonals_;
  std::vector<Place> blocks_;
  std::size_t panels_size_ = 0;
  std::size_t updates_size_ = 0;
  bool is_too_large_ = false;
};

}  // namespace tessera::joints
