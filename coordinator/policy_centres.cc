#include "coordinator/policy_centres.h"

#include <algorithm>
#include <limits>

namespace tessera {

BusyCells busy_cells(const Division& division) {
  BusyCells busy;
  for (std::size_t n = 0; n < division.cells.size(); ++n) {
    if (division.cells[n].cost <= 0) continue;
    busy.cells.push_back(n);
    busy.middles.push_back(middle_of(division.cells[n], division.anchor));
  }
  return busy;
}

std::vector<Eigen::Vector3d> centres_of(const Division& division, const BusyCells& busy) {
  if (busy.size() == 0) return {};
  const std::uint32_t servers = division.servers();
  std::vector<Eigen::Vector3d> centres(servers, Eigen::Vector3d::Zero());
  std::vector<double> costs(servers);
  for (std::size_t n = 0; n < busy.size(); ++n) {
    const Cell& cell = division.cells[busy.cells[n]];
    centres[cell.owner] += cell.cost * busy.middles[n];
    costs[cell.owner] += cell.cost;
  }
  std::vector<double> distances(busy.size(), std::numeric_limits<double>::infinity());  // squares
  const auto take_place = [&](const Eigen::Vector3d& centre) {
    for (std::size_t n = 0; n < busy.size(); ++n) {
      distances[n] = std::min(distances[n], (busy.middles[n] - centre).squaredNorm());
    }
  };
  for (Rank rank = 0; rank < servers; ++rank) {
    if (costs[rank] <= 0) continue;
    centres[rank] /= costs[rank];
    take_place(centres[rank]);
  }
  for (Rank rank = 0; rank < servers; ++rank) {
    if (costs[rank] > 0) continue;
    std::size_t best = 0;
    double most = -1;
    for (std::size_t n = 0; n < busy.size(); ++n) {
      const double worth = division.cells[busy.cells[n]].cost * distances[n];
      if (worth > most) {
        most = worth;
        best = n;
      }
    }
    centres[rank] = busy.middles[best];
    take_place(centres[rank]);
  }
  return centres;
}

}  // namespace tessera
