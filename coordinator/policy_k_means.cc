#include <algorithm>
#include <limits>

#include "coordinator/policies.h"
#include "coordinator/policy_centres.h"

namespace tessera {
namespace {

constexpr int kLloydSteps = 100;
// What a move of everything would have to gain, as a part of the mean strain.
constexpr double kWorthOfMoves = 0.25;

class Lloyd {
 public:
  Lloyd(const Division& division, const BusyCells& busy)
      : division_(division),
        busy_(busy),
        centres_(centres_of(division, busy)),
        handicaps_(division.servers()) {
    for (const Cell& cell : division.cells) {
      owners_.push_back(cell.owner);
      all_ += cell.cost;
    }
    best_ = owners_;
    least_ = badness();
    scale_ = spread() / division.servers();
  }

  std::vector<Rank> run() {
    for (int step = 0; step < kLloydSteps; ++step) {
      assign();
      const double now = badness();
      if (now < least_) {
        least_ = now;
        best_ = owners_;
      }
      handicap(1 / (1 + step / 8.0));
      recentre();
    }
    return best_;
  }

 private:
  // The mean square of the distances from the middle of all.
  double spread() const {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (std::size_t n = 0; n < busy_.size(); ++n) middle += cost(n) / all_ * busy_.middles[n];
    double sum = 0;
    for (std::size_t n = 0; n < busy_.size(); ++n) {
      sum += cost(n) / all_ * (busy_.middles[n] - middle).squaredNorm();
    }
    return sum;
  }

  double cost(std::size_t busy) const { return division_.cells[busy_.cells[busy]].cost; }

  void assign() {
    for (std::size_t n = 0; n < busy_.size(); ++n) {
      double nearest = std::numeric_limits<double>::infinity();
      for (Rank rank = 0; rank < centres_.size(); ++rank) {
        const double far = (busy_.middles[n] - centres_[rank]).squaredNorm() + handicaps_[rank];
        if (far < nearest) {
          nearest = far;
          owners_[busy_.cells[n]] = rank;
        }
      }
    }
  }

  void handicap(double eagerness) {
    const double mean = all_ / division_.servers();
    const std::vector<double> now = strains(division_, owners_);
    for (Rank rank = 0; rank < now.size(); ++rank) {
      // Nobody runs away from a cell that is heavier than a server's part.
      handicaps_[rank] += eagerness * scale_ * std::min(now[rank] / mean - 1, 1.0);
    }
  }

  void recentre() {
    std::vector<Eigen::Vector3d> sums(centres_.size(), Eigen::Vector3d::Zero());
    std::vector<double> costs(centres_.size());
    for (std::size_t n = 0; n < busy_.size(); ++n) {
      const Rank owner = owners_[busy_.cells[n]];
      sums[owner] += cost(n) * busy_.middles[n];
      costs[owner] += cost(n);
    }
    for (Rank rank = 0; rank < centres_.size(); ++rank) {
      if (costs[rank] > 0) centres_[rank] = sums[rank] / costs[rank];
    }
  }

  // The largest strain, by the mean, and a little for what moves.
  double badness() const {
    const std::vector<double> now = strains(division_, owners_);
    double moved = 0;
    for (std::size_t n = 0; n < owners_.size(); ++n) {
      if (owners_[n] != division_.cells[n].owner) moved += division_.cells[n].cost;
    }
    const double mean = all_ / division_.servers();
    return *std::max_element(now.begin(), now.end()) / mean + kWorthOfMoves * moved / all_;
  }

  const Division& division_;
  const BusyCells& busy_;
  std::vector<Eigen::Vector3d> centres_;
  std::vector<double> handicaps_;  // squares of sectors
  std::vector<Rank> owners_;
  std::vector<Rank> best_;
  double all_ = 0;
  double scale_ = 0;
  double least_ = 0;
};

}  // namespace

std::vector<Rank> divide_k_means(const Division& division) {
  const BusyCells busy = busy_cells(division);
  if (busy.size() > 0) return Lloyd(division, busy).run();
  std::vector<Rank> owners;
  for (const Cell& cell : division.cells) owners.push_back(cell.owner);
  return owners;
}

}  // namespace tessera
