#include "coordinator/balance.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "coordinator/limits.h"

namespace tessera {
namespace {

// Hysteresis: servers that differ by less are left alone, and so are those that would gain less. Nor is it
// worth anything where a tick takes next to no time.
constexpr double kImbalanceMin = 1.2;
constexpr double kSlowestThenMax = 0.9;
constexpr double kSlowestMin = 200;  // us

struct Entry {
  SectorIndex first;
  double us = 0;
  std::uint64_t sectors = 0;
  std::uint64_t bodies = 0;
};

// Of all servers, along the curve.
std::vector<Entry> entries_of(const SectorMap& map, std::span<const ServerLoad> loads) {
  std::vector<Entry> entries;
  // Before there are measurements, work counts.
  const bool is_measured =
      std::any_of(loads.begin(), loads.end(), [](const ServerLoad& load) { return load.tick_us > 0; });
  for (const ServerLoad& load : loads) {
    const double work = std::accumulate(load.pieces.begin(), load.pieces.end(), 0.0,
                                        [](double sum, const LoadPiece& piece) { return sum + piece.work; });
    const double us = !is_measured ? 1 : work > 0 ? load.tick_us / work : 0;
    for (const LoadPiece& piece : load.pieces)
      entries.push_back({piece.first, piece.work * us, piece.sectors, piece.bodies});
  }
  std::stable_sort(entries.begin(), entries.end(), [&](const Entry& a, const Entry& b) {
    return comes_before_on_curve(a.first, b.first, map.anchor());
  });
  return entries;
}

std::vector<double> shares(const SectorMap& map, const std::vector<Entry>& entries) {
  std::vector<double> us(map.servers());
  for (const Entry& entry : entries) us[map.owner(entry.first)] += entry.us;
  return us;
}

double largest(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }

SectorMap cut_by_load(const SectorMap& map, const std::vector<Entry>& entries) {
  std::vector<std::pair<SectorIndex, double>> load;
  for (const Entry& entry : entries) {
    if (entry.us > 0) load.emplace_back(entry.first, entry.us);
  }
  if (load.empty()) return map;
  return SectorMap::balanced(map.anchor(), std::move(load), map.servers(), map.epoch() + 1);
}

// Where the runs begin: the number of entries before the run of each rank but the first.
std::vector<std::size_t> beginnings(const SectorMap& map, const std::vector<Entry>& entries) {
  std::vector<std::size_t> begins;
  for (Rank rank = 1; rank < map.servers(); ++rank) {
    const auto begin = std::partition_point(
        entries.begin(), entries.end(), [&](const Entry& entry) { return map.owner(entry.first) < rank; });
    begins.push_back(static_cast<std::size_t>(begin - entries.begin()));
  }
  return begins;
}

// As far from `from` towards `to` as the entries between have at most `room` sectors and bodies; one at
// least.
std::size_t limited(std::size_t from, std::size_t to, const std::vector<Entry>& entries, std::uint64_t room) {
  std::uint64_t moved = 0;
  std::size_t place = from;
  while (place != to) {
    const std::size_t next = place < to ? place + 1 : place - 1;
    const Entry& passed = entries[std::min(place, next)];
    moved += passed.sectors + passed.bodies;
    if (moved > room && place != from) break;
    place = next;
  }
  return place;
}

// A map on the way from one to the other.
SectorMap part_of_the_way(const SectorMap& from, const SectorMap& to, const std::vector<Entry>& entries) {
  const std::vector<std::size_t> old_begins = beginnings(from, entries);
  const std::vector<std::size_t> new_begins = beginnings(to, entries);
  std::vector<SectorIndex> splitters;
  for (std::size_t n = 0; n < old_begins.size(); ++n) {
    const std::size_t begin =
        limited(old_begins[n], new_begins[n], entries, kMovedAtOnceMax / old_begins.size());
    SectorIndex splitter = from.splitters()[n];
    if (begin != old_begins[n]) {
      splitter = begin == new_begins[n] ? to.splitters()[n] : entries[begin].first;
    }
    const bool descends =
        !splitters.empty() && comes_before_on_curve(splitter, splitters.back(), from.anchor());
    splitters.push_back(descends ? splitters.back() : splitter);
  }
  return SectorMap(from.anchor(), std::move(splitters), to.epoch());
}

}  // namespace

bool BalancePlan::is_worth_it() const {
  return moves() && imbalance >= kImbalanceMin && slowest_then <= kSlowestThenMax &&
         largest(tick_us) >= kSlowestMin;
}

BalancePlan plan_balance(const SectorMap& map, std::span<const ServerLoad> loads) {
  const std::vector<Entry> entries = entries_of(map, loads);
  BalancePlan plan;
  plan.map = map;
  for (const ServerLoad& load : loads) plan.tick_us.push_back(load.tick_us);
  plan.tick_us_then = plan.tick_us;
  const std::vector<double> before = shares(map, entries);
  const double slowest = largest(before);
  if (slowest <= 0 || map.servers() < 2) return plan;
  const double mean = std::accumulate(before.begin(), before.end(), 0.0) / map.servers();
  const SectorMap whole = cut_by_load(map, entries);
  plan.imbalance = slowest / mean;
  const double slowest_then = largest(shares(whole, entries)) / slowest;
  if (slowest_then >= 1) return plan;
  plan.slowest_then = slowest_then;

  SectorMap next = part_of_the_way(map, whole, entries);
  for (const Entry& entry : entries) {
    const Rank now = map.owner(entry.first);
    const Rank then = next.owner(entry.first);
    if (now == then) continue;
    plan.moved_sectors += entry.sectors;
    plan.moved_bodies += entry.bodies;
  }
  if (!plan.moves()) return plan;
  plan.tick_us_then = shares(next, entries);
  if (largest(plan.tick_us) == 0) plan.tick_us_then = plan.tick_us;
  plan.map = std::move(next);
  return plan;
}

}  // namespace tessera
