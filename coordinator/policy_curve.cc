#include "coordinator/policies.h"

namespace tessera {

std::vector<Rank> divide_curve(const Division& division) {
  double all = 0;
  for (const Cell& cell : division.cells) all += cell.cost;
  std::vector<Rank> owners;
  owners.reserve(division.cells.size());
  Rank rank = 0;
  double sum = 0;
  double share = division.parts[0] * all;  // of the servers so far
  for (const Cell& cell : division.cells) {
    // A cell starts a new run when the runs before it have their share; its middle decides.
    const bool is_next = cell.cost > 0 && sum > 0 && sum + cell.cost / 2 >= share;
    if (is_next && rank + 1 < division.servers()) share += division.parts[++rank] * all;
    sum += cell.cost;
    owners.push_back(all > 0 ? rank : cell.owner);
  }
  return owners;
}

}  // namespace tessera
