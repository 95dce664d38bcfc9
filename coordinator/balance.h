// Divides a running world anew among its servers, by what each has to do.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "lpss/grid/sector_map.h"
#include "lpss/observe/load.h"

namespace tessera {

struct ServerLoad {
  std::vector<LoadPiece> pieces;
  double tick_us = 0;  // own work of a tick, mean; of all its pieces
};

struct BalancePlan {
  SectorMap map;                     // the same as before where nothing moves
  std::vector<double> tick_us;       // by rank: own work of a tick, as measured
  std::vector<double> tick_us_then;  // with the new map, by the measured cost of what moves
  std::uint64_t moved_sectors = 0;
  std::uint64_t moved_bodies = 0;
  // Of the slowest server and the mean of all, before; of the slowest then, and before. By the loads that
  // come, if these are projected, and by all that is to move, which may take several plans.
  double imbalance = 1;
  double slowest_then = 1;

  bool moves() const { return moved_sectors > 0; }
  // Whether it is worth its trouble, unless somebody asks for it.
  bool is_worth_it() const;
};

// Cuts the curve of `map` so that all servers (`loads`, by rank) have about the same to do. A plan moves a
// bounded number of sectors and bodies: it goes part of the way where more would have to move.
BalancePlan plan_balance(const SectorMap& map, std::span<const ServerLoad> loads);

}  // namespace tessera
