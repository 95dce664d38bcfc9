#include <limits>

#include "coordinator/policies.h"

namespace tessera {
namespace {

// So many boxes along each axis, of all that have the product, with the smallest faces between them.
Eigen::Array3i boxes_of(int servers, const Eigen::Array3d& size) {
  Eigen::Array3i best(servers, 1, 1);
  double faces_best = std::numeric_limits<double>::infinity();
  for (int a = 1; a <= servers; ++a) {
    if (servers % a != 0) continue;
    for (int b = 1; b <= servers / a; ++b) {
      if (servers / a % b != 0) continue;
      const Eigen::Array3i counts(a, b, servers / a / b);
      // None is thinner than a sector, as far as that can be.
      const double thin = (counts.cast<double>() / size).max(1).prod();
      const double faces = ((counts - 1).cast<double>() / size).sum() * thin;
      if (faces >= faces_best) continue;
      best = counts;
      faces_best = faces;
    }
  }
  return best;
}

}  // namespace

std::vector<Rank> divide_grid(const Division& division) {
  std::vector<Rank> owners(division.cells.size());
  if (owners.empty()) return owners;
  std::vector<Eigen::Array3d> middles;
  for (const Cell& cell : division.cells) middles.push_back(middle_of(cell, division.anchor));
  Eigen::Array3d low = middles.front();
  Eigen::Array3d high = low;
  for (const Eigen::Array3d& middle : middles) {
    low = low.min(middle);
    high = high.max(middle);
  }
  const Eigen::Array3d size = high - low + 1;
  const Eigen::Array3i boxes = boxes_of(static_cast<int>(division.servers()), size);
  for (std::size_t n = 0; n < owners.size(); ++n) {
    const Eigen::Array3d share = (middles[n] - low) / size;
    // The end of a very long box is its size, rounded.
    const Eigen::Array3i place = (share * boxes.cast<double>()).floor().cast<int>().min(boxes - 1);
    owners[n] = static_cast<Rank>((place[0] * boxes[1] + place[1]) * boxes[2] + place[2]);
  }
  return owners;
}

}  // namespace tessera
