// Divides a running world anew among its servers, by what each has to do.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "coordinator/balance_policy.h"
#include "coordinator/cells.h"
#include "lpss/grid/sector_map.h"

namespace tessera {

// Nothing is worth its trouble where a tick takes next to no time, or where more than this part of it is
// left.
inline constexpr double kSlowestMin = 200;  // us
inline constexpr double kSlowestThenMax = 0.9;

struct BalancePlan {
  SectorMap map;                     // the same as before where nothing moves
  std::vector<double> tick_us;       // by rank: own work of a tick, as measured
  std::vector<double> tick_us_then;  // with the new map, by the measured cost of what moves
  std::uint64_t moved_sectors = 0;
  std::uint64_t moved_bodies = 0;
  // The slowest server by the mean of all, before; how long it takes; the slowest then by that. By the loads
  // that come, if these are projected, and by all that is to move, which may take several plans.
  double imbalance = 1;
  double slowest_us = 0;
  double slowest_then = 1;
  bool consolidates = false;  // all that is awake goes to one server (coordinator/consolidation.h)
  double wait_us = 0;         // then: of servers for each other in a tick, before

  bool moves() const { return moved_sectors > 0; }
  // Whether it is worth its trouble, unless somebody asks for it.
  bool is_worth_it() const;
};

// Divides the world of `map` by the policy, so that all servers (`loads`, by rank) take about equally long.
// A plan moves a bounded number of sectors and bodies: it goes part of the way where more would have to move.
// Nothing moves where the slowest server would not become faster, unless the policy does not look at the
// load.
BalancePlan plan_balance(const SectorMap& map, std::span<const ServerLoad> loads,
                         BalancePolicy policy = BalancePolicy::kCurve);

// Gives all that the server of that rank has to others, of which each gets what the policy gives it where
// they share out the world without that server; what the others have stays where it is. In steps of a bounded
// number of sectors and bodies, unless `at_once`.
struct DeparturePlan {
  SectorMap map;
  std::uint64_t moved_sectors = 0;
  std::uint64_t moved_bodies = 0;
  bool is_last = false;  // the server has nothing left
};
DeparturePlan plan_departure(const SectorMap& map, std::span<const ServerLoad> loads, Rank leaver,
                             BalancePolicy policy, bool at_once);

// The same map of one server more, which has the last rank and no sector; and of one less, which had none, so
// that the ranks after it are smaller by one.
SectorMap with_another(const SectorMap& map);
SectorMap without(const SectorMap& map, Rank leaver);

// The map of a world that is loaded on servers of these capacities, by what its sectors weigh (> 0): of the
// grid, its boxes; of the others, the curve cut by weight, from where on they follow the load.
SectorMap first_map(const SectorIndex& anchor, const std::vector<std::pair<SectorIndex, double>>& load,
                    std::span<const double> capacities, std::uint64_t epoch, BalancePolicy policy);

}  // namespace tessera
