#include <algorithm>
#include <limits>
#include <optional>
#include <queue>
#include <utility>

#include "coordinator/policies.h"
#include "coordinator/policy_centres.h"

namespace tessera {
namespace {

constexpr int kEvenings = 32;             // passes over all cells, at most
constexpr double kEvenedOutBelow = 1.02;  // of the mean strain: such a server gives nothing away

class Hulls {
 public:
  Hulls(const Division& division, const BusyCells& busy)
      : division_(division), neighbours_(neighbours_of(division)), centres_(centres_of(division, busy)) {
    for (const Cell& cell : division.cells) owners_.push_back(cell.owner);
    is_free_.assign(owners_.size(), false);
    middles_.resize(owners_.size());
    for (std::size_t n = 0; n < busy.size(); ++n) {
      is_free_[busy.cells[n]] = true;
      middles_[busy.cells[n]] = busy.middles[n];
      all_ += division.cells[busy.cells[n]].cost;
    }
    is_busy_ = is_free_;
    costs_.resize(division.servers());
    borders_.resize(division.servers());
  }

  std::vector<Rank> run() {
    plant();
    std::size_t first = 0;
    for (;;) {
      if (const std::optional<Rank> rank = next_to_grow()) {
        take(borders_[*rank].top().second, *rank);
        continue;
      }
      // What no region reaches, such as another town: a server that has of it goes on there.
      while (first < is_free_.size() && !is_free_[first]) ++first;
      if (first == is_free_.size()) break;
      const Rank owner = division_.cells[first].owner;
      take(first, strain(owner) < mean() ? owner : least_strained());
    }
    for (int pass = 0; pass < kEvenings && even_out(); ++pass) {
    }
    return owners_;
  }

 private:
  double mean() const { return all_ / division_.servers(); }
  double strain(Rank rank, double more = 0) const {
    return (costs_[rank] + more) / (division_.parts[rank] * division_.servers());
  }
  double cost(std::size_t cell) const { return division_.cells[cell].cost; }

  Rank least_strained() const {
    Rank least = 0;
    for (Rank rank = 1; rank < costs_.size(); ++rank) {
      if (strain(rank) < strain(least)) least = rank;
    }
    return least;
  }

  // Each region begins with the free cell that is nearest to its centre.
  void plant() {
    for (Rank rank = 0; rank < centres_.size(); ++rank) {
      std::optional<std::size_t> seed;
      double nearest = std::numeric_limits<double>::infinity();
      for (std::size_t cell = 0; cell < is_free_.size(); ++cell) {
        if (!is_free_[cell]) continue;
        const double far = (middles_[cell] - centres_[rank]).squaredNorm();
        if (far < nearest) {
          nearest = far;
          seed = cell;
        }
      }
      if (seed) take(*seed, rank);
    }
  }

  void take(std::size_t cell, Rank rank) {
    is_free_[cell] = false;
    owners_[cell] = rank;
    costs_[rank] += cost(cell);
    for (const CellBorder& neighbour : neighbours_[cell]) {
      if (!is_free_[neighbour.cell]) continue;
      borders_[rank].push({(middles_[neighbour.cell] - centres_[rank]).squaredNorm(), neighbour.cell});
    }
  }

  // Of those that have somewhere to grow.
  std::optional<Rank> next_to_grow() {
    std::optional<Rank> next;
    for (Rank rank = 0; rank < borders_.size(); ++rank) {
      while (!borders_[rank].empty() && !is_free_[borders_[rank].top().second]) borders_[rank].pop();
      if (borders_[rank].empty()) continue;
      if (!next || strain(rank) < strain(*next)) next = rank;
    }
    return next;
  }

  // Cells at borders go to the neighbour with the least strain where that is less than it was here.
  bool even_out() {
    bool is_changed = false;
    for (std::size_t cell = 0; cell < owners_.size(); ++cell) {
      const Rank owner = owners_[cell];
      if (!is_busy_[cell] || strain(owner) < kEvenedOutBelow * mean()) continue;
      Rank best = owner;
      double least = strain(owner);
      for (const CellBorder& neighbour : neighbours_[cell]) {
        const Rank other = owners_[neighbour.cell];
        if (other == owner || !is_busy_[neighbour.cell]) continue;
        const double then = strain(other, cost(cell));
        if (then < least) {
          least = then;
          best = other;
        }
      }
      if (best == owner) continue;
      costs_[owner] -= cost(cell);
      costs_[best] += cost(cell);
      owners_[cell] = best;
      is_changed = true;
    }
    return is_changed;
  }

  using Border = std::priority_queue<std::pair<double, std::size_t>,
                                     std::vector<std::pair<double, std::size_t>>, std::greater<>>;

  const Division& division_;
  const std::vector<std::vector<CellBorder>> neighbours_;
  const std::vector<Eigen::Vector3d> centres_;
  std::vector<Rank> owners_;
  std::vector<bool> is_free_;  // busy, and in no region yet
  std::vector<bool> is_busy_;
  std::vector<Eigen::Vector3d> middles_;  // of busy ones
  std::vector<double> costs_;             // by rank
  std::vector<Border> borders_;           // by rank: where it may grow, the nearest to its centre first
  double all_ = 0;
};

}  // namespace

std::vector<Rank> divide_hulls(const Division& division) {
  return Hulls(division, busy_cells(division)).run();
}

}  // namespace tessera
