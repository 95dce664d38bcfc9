#include "coordinator/balance.h"

#include <algorithm>
#include <functional>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "coordinator/limits.h"
#include "coordinator/policies.h"
#include "lpss/base/invariant.h"

namespace tessera {
namespace {

// Hysteresis: servers that differ by less are left alone.
constexpr double kImbalanceMin = 1.2;

double largest(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }

std::vector<Rank> owners_of(const Division& division) {
  std::vector<Rank> owners;
  for (const Cell& cell : division.cells) owners.push_back(cell.owner);
  return owners;
}

// Chooses what moves first where not all may move at once.
class PartOfTheWay {
 public:
  PartOfTheWay(const Division& division, const std::vector<Rank>& wanted)
      : division_(division), wanted_(wanted), owners_(owners_of(division)), us_(strains(division, owners_)) {
    for (const Cell& cell : division.cells) middles_.push_back(middle_of(cell, division.anchor));
  }

  std::vector<Rank> owners() {
    std::uint64_t all = 0;
    for (std::size_t n = 0; n < owners_.size(); ++n) {
      if (owners_[n] != wanted_[n]) all += division_.cells[n].size();
    }
    if (all <= kMovedAtOnceMax) return wanted_;
    queue_up();
    const double most = largest(us_);
    std::uint64_t moved = 0;
    while (const auto pair = steepest()) {
      std::vector<std::size_t>& queue = queues_[*pair];
      const std::size_t cell = queue.back();
      queue.pop_back();
      if (queue.empty()) queues_.erase(*pair);
      const std::uint64_t size = division_.cells[cell].size();
      if (moved > 0 && moved + size > kMovedAtOnceMax) break;
      // Exchanges are left for later, where they would make another server the slowest one.
      if (us_[pair->second] + us_of(cell, pair->second) > most) continue;
      us_[pair->first] -= us_of(cell, pair->first);
      us_[pair->second] += us_of(cell, pair->second);
      owners_[cell] = pair->second;
      moved += size;
    }
    return owners_;
  }

 private:
  using Pair = std::pair<Rank, Rank>;  // from, to

  double us_of(std::size_t cell, Rank rank) const {
    return division_.cells[cell].cost / (division_.parts[rank] * division_.servers());
  }

  // Where a server's busy cells are, or are going to be where it has none.
  std::vector<Eigen::Vector3d> centres() const {
    const std::uint32_t servers = division_.servers();
    std::vector<Eigen::Vector3d> sums[2];
    std::vector<double> costs[2];
    for (const int then : {0, 1}) {
      sums[then].resize(servers, Eigen::Vector3d::Zero());
      costs[then].resize(servers);
      for (std::size_t n = 0; n < owners_.size(); ++n) {
        const Rank owner = then == 0 ? owners_[n] : wanted_[n];
        sums[then][owner] += division_.cells[n].cost * middles_[n];
        costs[then][owner] += division_.cells[n].cost;
      }
    }
    for (Rank rank = 0; rank < servers; ++rank) {
      const int then = costs[0][rank] > 0 ? 0 : 1;
      if (costs[then][rank] > 0) sums[0][rank] = sums[then][rank] / costs[then][rank];
    }
    return std::move(sums[0]);
  }

  // Servers grow from where they are: the nearest cells come first, at the ends of the queues.
  void queue_up() {
    const std::vector<Eigen::Vector3d> centre = centres();
    for (std::size_t n = 0; n < owners_.size(); ++n) {
      if (owners_[n] != wanted_[n]) queues_[{owners_[n], wanted_[n]}].push_back(n);
    }
    for (auto& [pair, queue] : queues_) {
      std::ranges::stable_sort(queue, std::greater<>(), [&, to = pair.second](std::size_t cell) {
        return (middles_[cell] - centre[to]).squaredNorm();
      });
    }
  }

  // The pair of servers that differ most, of those that something is to move between.
  std::optional<Pair> steepest() const {
    std::optional<Pair> best;
    double most = 0;
    for (const auto& [pair, queue] : queues_) {
      const double difference = us_[pair.first] - us_[pair.second];
      if (!best || difference > most) {
        best = pair;
        most = difference;
      }
    }
    return best;
  }

  const Division& division_;
  const std::vector<Rank>& wanted_;
  std::vector<Rank> owners_;
  std::vector<double> us_;  // by rank
  std::vector<Eigen::Vector3d> middles_;
  std::map<Pair, std::vector<std::size_t>> queues_;
};

}  // namespace

bool BalancePlan::is_worth_it() const {
  return moves() && imbalance >= kImbalanceMin && slowest_then <= kSlowestThenMax &&
         largest(tick_us) >= kSlowestMin;
}

BalancePlan plan_balance(const SectorMap& map, std::span<const ServerLoad> loads, BalancePolicy policy) {
  BalancePlan plan;
  plan.map = map;
  for (const ServerLoad& load : loads) plan.tick_us.push_back(load.tick_us);
  plan.tick_us_then = plan.tick_us;
  const Division division = division_of(map, loads);
  const std::vector<double> before = strains(division, owners_of(division));
  const double slowest = largest(before);
  if (slowest <= 0 || map.servers() < 2) return plan;
  double all = 0;
  for (const Cell& cell : division.cells) all += cell.cost;
  plan.imbalance = slowest / (all / map.servers());
  plan.slowest_us = slowest;
  const std::vector<Rank> wanted = divide(policy, division);
  const double slowest_then = largest(strains(division, wanted)) / slowest;
  if (slowest_then >= 1 && follows_load(policy)) return plan;
  plan.slowest_then = slowest_then;

  const std::vector<Rank> owners = PartOfTheWay(division, wanted).owners();
  for (std::size_t n = 0; n < owners.size(); ++n) {
    const Cell& cell = division.cells[n];
    if (owners[n] == cell.owner) continue;
    plan.moved_sectors += cell.sectors;
    plan.moved_bodies += cell.bodies;
  }
  if (!plan.moves()) return plan;
  if (largest(plan.tick_us) > 0) plan.tick_us_then = strains(division, owners);
  plan.map = map_of(division, owners, map.epoch() + 1);
  return plan;
}

namespace {

// The owners of the map's runs, also where these are in the order of ranks.
std::vector<Rank> owners_of(const SectorMap& map) {
  std::vector<Rank> owners = map.owners();
  if (!owners.empty()) return owners;
  owners.resize(map.splitters().size() + 1);
  std::iota(owners.begin(), owners.end(), Rank{0});
  return owners;
}

// As if the server were not there: its cells are at those that have the ones before on the curve, or after.
Division division_without(const Division& division, Rank leaver) {
  Division rest = division;
  rest.parts.erase(rest.parts.begin() + leaver);
  const double left = std::accumulate(rest.parts.begin(), rest.parts.end(), 0.0);
  for (double& part : rest.parts) part /= left;
  std::optional<Rank> near;
  for (const Cell& cell : division.cells) {
    if (cell.owner == leaver) continue;
    near = cell.owner;
    break;
  }
  Rank owner = near.value_or(leaver == 0 ? 1 : 0);
  for (Cell& cell : rest.cells) {
    if (cell.owner != leaver) owner = cell.owner;
    cell.owner = owner > leaver ? owner - 1 : owner;
  }
  return rest;
}

}  // namespace

DeparturePlan plan_departure(const SectorMap& map, std::span<const ServerLoad> loads, Rank leaver,
                             BalancePolicy policy, bool at_once) {
  const Division division = division_of(map, loads);
  invariant(map.servers() > 1, "the last server does not leave");
  const std::vector<Rank> wanted = map.servers() == 2 ? std::vector<Rank>(division.cells.size(), 0)
                                                      : divide(policy, division_without(division, leaver));
  std::vector<Rank> owners = owners_of(division);
  DeparturePlan plan;
  plan.is_last = true;
  for (std::size_t n = 0; n < owners.size(); ++n) {
    const Cell& cell = division.cells[n];
    if (cell.owner != leaver) continue;
    const std::uint64_t moved = plan.moved_sectors + plan.moved_bodies;
    if (!at_once && moved > 0 && moved + cell.size() > kMovedAtOnceMax) {
      plan.is_last = false;
      break;
    }
    owners[n] = wanted[n] >= leaver ? wanted[n] + 1 : wanted[n];
    plan.moved_sectors += cell.sectors;
    plan.moved_bodies += cell.bodies;
  }
  plan.map = map_of(division, owners, map.epoch() + 1);
  if (!plan.is_last) return plan;
  // Where there is no cell, or so many runs that some were joined, it may own what nothing is in.
  std::vector<Rank> last = owners_of(plan.map);
  for (std::size_t run = 0; run < last.size(); ++run) {
    if (last[run] == leaver) last[run] = run > 0 ? last[run - 1] : leaver == 0 ? 1 : 0;
  }
  plan.map = SectorMap(plan.map.anchor(), plan.map.splitters(), last, map.servers(), plan.map.epoch());
  return plan;
}

SectorMap with_another(const SectorMap& map) {
  return {map.anchor(), map.splitters(), owners_of(map), map.servers() + 1, map.epoch() + 1};
}

SectorMap without(const SectorMap& map, Rank leaver) {
  std::vector<Rank> owners = owners_of(map);
  for (Rank& owner : owners) {
    invariant(owner != leaver, "a server that leaves has no sectors");
    if (owner > leaver) --owner;
  }
  return {map.anchor(), map.splitters(), owners, map.servers() - 1, map.epoch() + 1};
}

SectorMap first_map(const SectorIndex& anchor, const std::vector<std::pair<SectorIndex, double>>& load,
                    std::span<const double> capacities, std::uint64_t epoch, BalancePolicy policy) {
  std::vector<ServerLoad> loads(capacities.size());
  for (std::size_t rank = 0; rank < loads.size(); ++rank) loads[rank].capacity = capacities[rank];
  for (const auto& [sector, weight] : load)
    loads.front().pieces.push_back({.first = sector, .work = weight, .sectors = 1});
  const SectorMap map(anchor, {}, {0}, static_cast<std::uint32_t>(loads.size()), epoch);
  const Division division = division_of(map, loads);
  return map_of(division, divide(follows_load(policy) ? BalancePolicy::kCurve : policy, division), epoch);
}

}  // namespace tessera
