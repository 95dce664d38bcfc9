#include "coordinator/cells.h"

#include <absl/container/flat_hash_map.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "lpss/base/invariant.h"

namespace tessera {
namespace {

double units_of(const ServerLoad& load) {
  return std::accumulate(load.pieces.begin(), load.pieces.end(), 0.0,
                         [](double sum, const LoadPiece& piece) { return sum + piece.work; });
}

std::vector<double> parts_of(std::span<const ServerLoad> loads) {
  double all = 0;
  for (const ServerLoad& load : loads) all += load.capacity;
  std::vector<double> parts;
  for (const ServerLoad& load : loads) parts.push_back(load.capacity / all);
  return parts;
}

// Each piece, and who has it by the map: load that is to come may be another's.
std::vector<Cell> entries_of(const SectorMap& map, std::span<const ServerLoad> loads,
                             const std::vector<double>& parts) {
  std::vector<Cell> entries;
  // Before there are measurements, work counts.
  const bool is_measured =
      std::any_of(loads.begin(), loads.end(), [](const ServerLoad& load) { return load.tick_us > 0; });
  for (std::size_t rank = 0; rank < loads.size(); ++rank) {
    const ServerLoad& load = loads[rank];
    const double units = units_of(load);
    // What takes a strong server so long would take longer elsewhere.
    const double strength = parts[rank] * static_cast<double>(parts.size());
    const double us = !is_measured ? 1 : units > 0 ? load.tick_us / units * strength : 0;
    for (const LoadPiece& piece : load.pieces) {
      entries.push_back({.first = first_of_cube(piece.first, piece.level, map.anchor()),
                         .level = piece.level,
                         .cost = piece.work * us,
                         .sectors = piece.sectors,
                         .bodies = piece.bodies,
                         .owner = map.owner(piece.first)});
    }
  }
  return entries;
}

// The curve with its runs, as cells begin and end on it.
class Runs {
 public:
  explicit Runs(const SectorIndex& anchor) : anchor_(anchor) {}

  void begin(const SectorIndex& first, unsigned level, Rank owner) {
    end_before(first);
    append(first, owner);
    around_.push_back({first_after_cube(first, level, anchor_), owner});
  }
  void end() {
    while (!around_.empty()) leave();
  }

  const std::vector<SectorIndex>& splitters() const { return splitters_; }
  std::vector<Rank>& owners() { return owners_; }
  std::size_t run_at(const SectorIndex& sector) const {
    const auto after = std::upper_bound(
        splitters_.begin(), splitters_.end(), sector,
        [&](const SectorIndex& a, const SectorIndex& b) { return comes_before_on_curve(a, b, anchor_); });
    return static_cast<std::size_t>(after - splitters_.begin());
  }

 private:
  struct Around {
    std::optional<SectorIndex> after;
    Rank owner = 0;
  };

  void end_before(const SectorIndex& first) {
    while (!around_.empty() && around_.back().after &&
           !comes_before_on_curve(first, *around_.back().after, anchor_)) {
      leave();
    }
  }

  // What follows belongs to the cell around the one that ends, if there is one.
  void leave() {
    const Around ended = around_.back();
    around_.pop_back();
    if (!around_.empty() && ended.after) append(*ended.after, around_.back().owner);
  }

  void append(const SectorIndex& first, Rank owner) {
    if (!owners_.empty() && owners_.back() == owner) return;
    if (!splitters_.empty() && splitters_.back() == first) {
      owners_.back() = owner;
      return;
    }
    if (!owners_.empty()) splitters_.push_back(first);
    owners_.push_back(owner);
  }

  const SectorIndex& anchor_;
  std::vector<SectorIndex> splitters_;
  std::vector<Rank> owners_;
  std::vector<Around> around_;
};

// The lightest runs join those before them.
void limit_runs(const Division& division, Runs& runs) {
  std::vector<Rank>& owners = runs.owners();
  if (owners.size() <= kMapRunsMax) return;
  std::vector<std::pair<double, std::uint64_t>> weights(owners.size());
  for (const Cell& cell : division.cells) {
    auto& [cost, size] = weights[runs.run_at(cell.first)];
    cost += cell.cost;
    size += cell.size();
  }
  std::vector<std::size_t> order(owners.size() - 1);
  std::iota(order.begin(), order.end(), 1);
  std::ranges::stable_sort(order, {}, [&](std::size_t run) { return weights[run]; });
  order.resize(owners.size() - kMapRunsMax);
  std::ranges::sort(order);
  for (const std::size_t run : order) owners[run] = owners[run - 1];
}

using Place = std::pair<SectorIndex, unsigned>;  // of a cube: first sector, level

std::uint64_t border_of(const Cell& a, const Cell& b) {
  constexpr unsigned kLevelMax = 20;
  const std::uint64_t face = std::uint64_t{1} << (2 * std::min({a.level, b.level, kLevelMax}));
  // Cells are rarely full: a world is mostly flat.
  const std::uint64_t sectors = std::min(a.sectors, b.sectors);
  return std::max<std::uint64_t>(1, std::min(face, sectors));
}

}  // namespace

Division division_of(const SectorMap& map, std::span<const ServerLoad> loads) {
  invariant(loads.size() == map.servers(), "every server tells its load");
  Division division;
  division.anchor = map.anchor();
  division.parts = parts_of(loads);
  std::vector<Cell> entries = entries_of(map, loads, division.parts);
  std::stable_sort(entries.begin(), entries.end(), [&](const Cell& a, const Cell& b) {
    if (a.first == b.first) return a.level > b.level;
    return comes_before_on_curve(a.first, b.first, map.anchor());
  });
  double largest = 0;  // of the parts of the last cell
  for (const Cell& entry : entries) {
    std::vector<Cell>& cells = division.cells;
    if (cells.empty() || cells.back().first != entry.first || cells.back().level != entry.level) {
      cells.push_back(entry);
      largest = entry.cost;
      continue;
    }
    Cell& cell = cells.back();
    if (entry.cost > largest) cell.owner = entry.owner;
    largest = std::max(largest, entry.cost);
    cell.cost += entry.cost;
    cell.sectors += entry.sectors;
    cell.bodies += entry.bodies;
  }
  return division;
}

Eigen::Vector3d middle_of(const Cell& cell, const SectorIndex& anchor) {
  constexpr std::uint64_t kMiddle = std::uint64_t{1} << 63;
  const double half = (std::ldexp(1.0, static_cast<int>(cell.level)) - 1) / 2;
  Eigen::Vector3d middle;
  const auto coordinates = curve_coordinates(cell.first, anchor);
  for (int axis = 0; axis < 3; ++axis) {
    middle[axis] = static_cast<double>(static_cast<std::int64_t>(coordinates[axis] - kMiddle)) + half;
  }
  return middle;
}

SectorMap map_of(const Division& division, const std::vector<Rank>& owners, std::uint64_t epoch) {
  invariant(owners.size() == division.cells.size(), "every cell has an owner");
  if (owners.empty()) return {division.anchor, {}, {0}, division.servers(), epoch};
  Runs runs(division.anchor);
  for (std::size_t n = 0; n < owners.size(); ++n) {
    runs.begin(division.cells[n].first, division.cells[n].level, owners[n]);
  }
  runs.end();
  limit_runs(division, runs);
  return {division.anchor, runs.splitters(), runs.owners(), division.servers(), epoch};
}

std::vector<std::vector<CellBorder>> neighbours_of(const Division& division) {
  const std::vector<Cell>& cells = division.cells;
  absl::flat_hash_map<Place, std::size_t> by_place;
  std::vector<unsigned> levels;
  for (std::size_t n = 0; n < cells.size(); ++n) {
    by_place.emplace(Place{cells[n].first, cells[n].level}, n);
    levels.push_back(cells[n].level);
  }
  std::ranges::sort(levels);
  levels.erase(std::unique(levels.begin(), levels.end()), levels.end());

  std::vector<std::vector<CellBorder>> neighbours(cells.size());
  const auto join = [&](std::size_t a, std::size_t b) {
    const std::uint64_t border = border_of(cells[a], cells[b]);
    neighbours[a].push_back({b, border});
    neighbours[b].push_back({a, border});
  };
  // The smallest cell of at least that level around a sector.
  const auto around = [&](const SectorIndex& sector, unsigned level) -> std::optional<std::size_t> {
    for (auto at = std::ranges::lower_bound(levels, level); at != levels.end(); ++at) {
      const auto found = by_place.find(Place{first_of_cube(sector, *at, division.anchor), *at});
      if (found != by_place.end()) return found->second;
    }
    return std::nullopt;
  };
  // Each looks for those that are as large as it is, or larger; of two equal ones, the lower does.
  for (std::size_t n = 0; n < cells.size(); ++n) {
    const Cell& cell = cells[n];
    if (cell.level >= kCurveLevelMax - 1) continue;
    if (const auto outer = around(cell.first, cell.level + 1)) join(n, *outer);
    const std::int64_t edge = std::int64_t{1} << cell.level;
    for (int axis = 0; axis < 3; ++axis) {
      for (const std::int64_t step : {-edge, edge}) {
        SectorOffset offset;
        (axis == 0 ? offset.i : axis == 1 ? offset.j : offset.k) = step;
        const absl::StatusOr<SectorIndex> beside = translated(cell.first, offset);
        if (!beside.ok()) continue;
        const std::optional<std::size_t> other = around(*beside, cell.level);
        if (!other || (cells[*other].level == cell.level && step < 0)) continue;
        join(n, *other);
      }
    }
  }
  // A large one may have been found on several sides, or around.
  for (std::vector<CellBorder>& of_one : neighbours) {
    std::ranges::sort(of_one, {}, &CellBorder::cell);
    const auto last = std::unique(of_one.begin(), of_one.end(),
                                  [](const CellBorder& a, const CellBorder& b) { return a.cell == b.cell; });
    of_one.erase(last, of_one.end());
  }
  return neighbours;
}

std::vector<double> strains(const Division& division, const std::vector<Rank>& owners) {
  std::vector<double> sums(division.servers());
  for (std::size_t n = 0; n < owners.size(); ++n) sums[owners[n]] += division.cells[n].cost;
  for (Rank rank = 0; rank < sums.size(); ++rank) sums[rank] /= division.parts[rank] * division.servers();
  return sums;
}

}  // namespace tessera
