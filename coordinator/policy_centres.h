// For policies that begin where servers' cells are today.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "coordinator/cells.h"

namespace tessera {

// The cells that cost something: what is shared out.
struct BusyCells {
  std::vector<std::size_t> cells;        // their places in the division, ascending
  std::vector<Eigen::Vector3d> middles;  // of these, in sectors

  std::size_t size() const { return cells.size(); }
};
BusyCells busy_cells(const Division& division);

// The middle of each server's busy cells, by cost. Of a server without any: the cell that costs most, and is
// farthest from all other centres. Empty if nothing is busy.
std::vector<Eigen::Vector3d> centres_of(const Division& division, const BusyCells& busy);

}  // namespace tessera
