#include "coordinator/consolidation.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "coordinator/limits.h"

namespace tessera {
namespace {

// A world keeps its pace easily where a tick takes no more than this part of its time.
constexpr double kEasyMax = 0.25;

// What one server is going to take, of the work of all, before it has been measured: some of it is done
// twice. That is tried where one server can do all of the work in this part of the time that a tick has, or
// of a time step, whatever comes out.
constexpr double kAloneGuess = 0.6;
constexpr double kTriedMax = 0.5;

// What it costs to be divided counts for less with each look, since it may have been due to something else: a
// world on one server is divided again now and then. It halves in 69 looks.
constexpr double kRemembered = 0.99;

// What a look at the load finds.
struct Look {
  Division division;
  double all_us = 0;   // own work of all servers in a tick, by a server of the mean capacity
  double work = 0;     // of all, in units
  int busy = 0;        // servers with any work
  double wait_us = 0;  // of the one of these that waits least: the others wait for its work, too
};

Look look_at(const SectorMap& map, std::span<const ServerLoad> loads) {
  Look look;
  look.division = division_of(map, loads);
  for (const Cell& cell : look.division.cells) look.all_us += cell.cost;
  for (const ServerLoad& load : loads) {
    double work = 0;
    for (const LoadPiece& piece : load.pieces) work += piece.work;
    if (work == 0) continue;
    look.work += work;
    look.wait_us = look.busy++ == 0 ? load.wait_us : std::min(look.wait_us, load.wait_us);
  }
  return look;
}

// All that is awake goes to the server of the largest capacity; of equal ones, to the one that has most of
// it.
BalancePlan plan_consolidation(const SectorMap& map, const Division& division) {
  std::vector<Rank> owners;
  for (const Cell& cell : division.cells) owners.push_back(cell.owner);
  BalancePlan plan;
  plan.consolidates = true;
  plan.tick_us = strains(division, owners);
  const auto rating = [&](Rank rank) { return std::pair(division.parts[rank], plan.tick_us[rank]); };
  Rank best = 0;
  for (Rank rank = 1; rank < division.servers(); ++rank) {
    if (rating(rank) > rating(best)) best = rank;
  }
  for (std::size_t n = 0; n < owners.size(); ++n) {
    const Cell& cell = division.cells[n];
    if (cell.cost == 0 || owners[n] == best) continue;
    owners[n] = best;
    plan.moved_sectors += cell.sectors;
    plan.moved_bodies += cell.bodies;
  }
  plan.tick_us_then = strains(division, owners);
  plan.map = map_of(division, owners, map.epoch() + 1);
  return plan;
}

}  // namespace

BalancePlan Consolidation::next(const SectorMap& map, std::span<const ServerLoad> loads, BalancePolicy policy,
                                std::chrono::duration<double, std::micro> time_step,
                                std::optional<std::chrono::duration<double, std::micro>> period) {
  const BalancePlan divided = plan_balance(map, loads, policy);
  BalancePlan nothing;
  nothing.map = map;
  const Look look = look_at(map, loads);
  const std::optional<double> divided_us = std::exchange(divided_us_, std::nullopt);
  if (look.all_us == 0 || *std::ranges::max_element(divided.tick_us) == 0) return nothing;
  const double then_us = divided.slowest_us * divided.slowest_then;

  if (look.busy == 1) {
    alone_us_ = look.all_us / look.work;
    extra_us_ = divided_us ? std::max(0.0, *divided_us - then_us) : kRemembered * extra_us_;
    const bool gains = then_us + extra_us_ <= kSlowestThenMax * divided.slowest_us;
    return divided.is_worth_it() && gains ? divided : nothing;
  }

  BalancePlan together = plan_consolidation(map, look.division);
  double alone_us = *std::ranges::max_element(together.tick_us_then);
  if (alone_us_) {
    alone_us *= *alone_us_ * look.work / look.all_us;
  } else if (alone_us <= kTriedMax * period.value_or(time_step).count()) {
    alone_us *= kAloneGuess;
  }
  const double tick_us = divided.slowest_us + look.wait_us;
  const double tick_min_us = period ? std::max(kSlowestMin, kEasyMax * period->count()) : kSlowestMin;
  if (together.moves() && together.moved_sectors + together.moved_bodies <= kMovedAtOnceMax &&
      tick_us >= tick_min_us && alone_us <= std::min(divided.slowest_us, then_us) + look.wait_us) {
    divided_us_ = tick_us;
    together.wait_us = look.wait_us;
    return together;
  }
  return divided.is_worth_it() ? divided : nothing;
}

}  // namespace tessera
