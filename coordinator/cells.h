// The world as those see it who divide it among servers: cells, what they cost, and where they are.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "lpss/grid/sector_map.h"
#include "lpss/observe/load.h"

namespace tessera {

struct ServerLoad {
  std::vector<LoadPiece> pieces;
  double tick_us = 0;   // own work of a tick, mean; of all its pieces
  double capacity = 1;  // how much it is to take, by comparison with the others
  double wait_us = 0;   // for other servers in a tick, mean
};

// A cube of the curve that stays on one server. One may have others in it, which it goes around.
struct Cell {
  SectorIndex first;  // of the cube
  unsigned level = 0;
  // Of a tick, on a server of the mean capacity; us where it was measured, else in units of work.
  double cost = 0;
  std::uint64_t sectors = 0;  // with all that lives in them: what a move moves
  std::uint64_t bodies = 0;
  Rank owner = 0;  // at present; where it has several, of the first sector that costs most

  std::uint64_t size() const { return sectors + bodies; }
};

// What is to be divided.
struct Division {
  SectorIndex anchor;         // of the curve
  std::vector<Cell> cells;    // ascending on it, the larger ones of the same place first
  std::vector<double> parts;  // by rank: what a server is to have of the cost of all; their sum is 1

  std::uint32_t servers() const { return static_cast<std::uint32_t>(parts.size()); }
};

// All that servers (by rank) say of a world with this map, which is to be shared out by their capacity.
Division division_of(const SectorMap& map, std::span<const ServerLoad> loads);

// Where the middle of a cell is: sectors from the middle of the anchor.
Eigen::Vector3d middle_of(const Cell& cell, const SectorIndex& anchor);

// The map with these owners of the cells. What is in no cell belongs to the owner of the cell before it on
// the curve. Where that would be more than kMapRunsMax runs, the lightest ones go to the owners of the ones
// before.
SectorMap map_of(const Division& division, const std::vector<Rank>& owners, std::uint64_t epoch);

struct CellBorder {
  std::size_t cell = 0;
  std::uint64_t border = 0;  // faces of sectors that they share, at most
};

// By cell: those that share a face with it, or that are around it or in it. Each knows the other.
std::vector<std::vector<CellBorder>> neighbours_of(const Division& division);

// By rank: how long the cells of a server take it, which is their cost by its capacity. Equal where all is
// shared out as it is to be; then it is the cost of all by the number of servers.
std::vector<double> strains(const Division& division, const std::vector<Rank>& owners);

}  // namespace tessera
