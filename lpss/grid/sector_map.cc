#include "lpss/grid/sector_map.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>

#include "lpss/base/invariant.h"

namespace tessera {
namespace {

// The index relative to the anchor, shifted so that unsigned order is signed order. Wraps around where the
// difference leaves 64 bits; the order there is odd, but the same for everyone.
std::array<std::uint64_t, 3> curve_coordinates(const SectorIndex& sector, const SectorIndex& anchor) {
  constexpr std::uint64_t kMiddle = std::uint64_t{1} << 63;
  const auto shifted = [](std::int64_t value, std::int64_t origin) {
    return (static_cast<std::uint64_t>(value) - static_cast<std::uint64_t>(origin)) + kMiddle;
  };
  return {shifted(sector.i, anchor.i), shifted(sector.j, anchor.j), shifted(sector.k, anchor.k)};
}

// Whether the highest set bit of `a` is below that of `b`.
bool shorter(std::uint64_t a, std::uint64_t b) { return a < b && a < (a ^ b); }

bool ascend(const std::vector<SectorIndex>& splitters, const SectorIndex& anchor) {
  return std::is_sorted(splitters.begin(), splitters.end(), [&](const SectorIndex& a, const SectorIndex& b) {
    return comes_before_on_curve(a, b, anchor);
  });
}

}  // namespace

std::uint64_t scrambled(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
  x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
  return x ^ (x >> 31);
}

// The order of two points on the curve is that of the coordinate in which they differ in the highest bit: no
// interleaved key of 192 bits is needed.
bool comes_before_on_curve(const SectorIndex& a, const SectorIndex& b, const SectorIndex& anchor) {
  const auto x = curve_coordinates(a, anchor);
  const auto y = curve_coordinates(b, anchor);
  int deciding = 0;
  for (int axis = 1; axis < 3; ++axis) {
    if (shorter(x[deciding] ^ y[deciding], x[axis] ^ y[axis])) deciding = axis;
  }
  return x[deciding] < y[deciding];
}

SectorMap::SectorMap(const SectorIndex& anchor, std::vector<SectorIndex> splitters, std::uint64_t epoch)
    : anchor_(anchor),
      splitters_(std::move(splitters)),
      servers_(static_cast<std::uint32_t>(splitters_.size()) + 1),
      epoch_(epoch) {
  invariant(ascend(splitters_, anchor_), "splitters of a sector map ascend on the curve");
}

absl::StatusOr<SectorMap> SectorMap::checked(const SectorIndex& anchor, std::vector<SectorIndex> splitters,
                                             std::size_t servers, std::uint64_t epoch) {
  if (splitters.size() + 1 != servers) {
    return absl::InvalidArgumentError(absl::StrCat("the sector map has ", splitters.size() + 1, " runs for ",
                                                   servers, " servers, and must have one for each"));
  }
  if (!ascend(splitters, anchor))
    return absl::InvalidArgumentError("the splitters of the sector map must ascend on the curve");
  return SectorMap(anchor, std::move(splitters), epoch);
}

SectorMap SectorMap::balanced(const SectorIndex& anchor, std::vector<std::pair<SectorIndex, double>> load,
                              std::uint32_t servers, std::uint64_t epoch) {
  std::sort(load.begin(), load.end(),
            [&](const auto& a, const auto& b) { return comes_before_on_curve(a.first, b.first, anchor); });
  double total = 0;
  for (const auto& [sector, weight] : load) total += weight;

  std::vector<SectorIndex> splitters;
  double sum = 0;
  for (const auto& [sector, weight] : load) {
    // A sector starts a new run when the runs before it have their share; its middle decides.
    const double share = total * static_cast<double>(splitters.size() + 1) / servers;
    if (splitters.size() + 1 < servers && sum > 0 && sum + weight / 2 >= share) splitters.push_back(sector);
    sum += weight;
  }
  // Fewer sectors than servers: the rest wait at the end of the curve for what may come.
  const SectorIndex last = splitters.empty() ? (load.empty() ? anchor : load.back().first) : splitters.back();
  while (splitters.size() + 1 < servers) splitters.push_back(last);
  return SectorMap(anchor, std::move(splitters), epoch);
}

SectorMap SectorMap::scattered(const SectorIndex& anchor, std::uint32_t servers, std::uint64_t seed,
                               std::uint64_t epoch) {
  SectorMap map(anchor, {}, epoch);
  map.servers_ = servers;
  map.scatter_ = seed | 1;
  return map;
}

Rank SectorMap::owner(const SectorIndex& sector) const {
  if (scatter_ != 0) {
    std::uint64_t mixed = scatter_;
    for (const std::uint64_t coordinate : curve_coordinates(sector, anchor_))
      mixed = scrambled(mixed ^ coordinate);
    return static_cast<Rank>(mixed % servers_);
  }
  const auto run = std::upper_bound(
      splitters_.begin(), splitters_.end(), sector,
      [&](const SectorIndex& a, const SectorIndex& b) { return comes_before_on_curve(a, b, anchor_); });
  return static_cast<Rank>(run - splitters_.begin());
}

}  // namespace tessera
