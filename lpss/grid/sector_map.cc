#include "lpss/grid/sector_map.h"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "lpss/base/invariant.h"

namespace tessera {
namespace {

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

SectorMap::SectorMap(const SectorIndex& anchor, std::vector<SectorIndex> splitters, std::uint64_t epoch)
    : anchor_(anchor),
      splitters_(std::move(splitters)),
      servers_(static_cast<std::uint32_t>(splitters_.size()) + 1),
      epoch_(epoch) {
  invariant(ascend(splitters_, anchor_), "splitters of a sector map ascend on the curve");
}

SectorMap::SectorMap(const SectorIndex& anchor, const std::vector<SectorIndex>& splitters,
                     const std::vector<Rank>& owners, std::uint32_t servers, std::uint64_t epoch)
    : anchor_(anchor), servers_(servers), epoch_(epoch) {
  invariant(owners.size() == splitters.size() + 1, "every run of a sector map has an owner");
  invariant(ascend(splitters, anchor_), "splitters of a sector map ascend on the curve");
  for (std::size_t run = 0; run < owners.size(); ++run) {
    invariant(owners[run] < servers, "owners of a sector map are servers of the world");
    if (run < splitters.size() && run > 0 && splitters[run] == splitters[run - 1]) continue;
    if (!owners_.empty() && owners_.back() == owners[run]) continue;
    if (run > 0) splitters_.push_back(splitters[run - 1]);
    owners_.push_back(owners[run]);
  }
  invariant(owners_.size() <= kMapRunsMax, "a sector map has a bounded number of runs");
  bool is_one_per_server = owners_.size() == servers;
  for (Rank rank = 0; rank < owners_.size(); ++rank) is_one_per_server &= owners_[rank] == rank;
  if (is_one_per_server) owners_.clear();
}

absl::StatusOr<SectorMap> SectorMap::checked(const SectorIndex& anchor, std::vector<SectorIndex> splitters,
                                             const std::vector<Rank>& owners, std::size_t servers,
                                             std::uint64_t epoch) {
  if (!owners.empty() && owners.size() != splitters.size() + 1) {
    return absl::InvalidArgumentError(
        absl::StrCat("the sector map has ", splitters.size() + 1, " runs, and owners for ", owners.size()));
  }
  if (owners.size() > kMapRunsMax) {
    return absl::InvalidArgumentError(
        absl::StrCat("the sector map has ", owners.size(), " runs, and may have at most ", kMapRunsMax));
  }
  if (std::any_of(owners.begin(), owners.end(), [&](Rank owner) { return owner >= servers; })) {
    return absl::InvalidArgumentError(
        absl::StrCat("a run of the sector map has an owner that is none of the ", servers, " servers"));
  }
  if (owners.empty() && splitters.size() + 1 != servers) {
    return absl::InvalidArgumentError(absl::StrCat("the sector map has ", splitters.size() + 1, " runs for ",
                                                   servers, " servers, and must have one for each"));
  }
  if (!ascend(splitters, anchor))
    return absl::InvalidArgumentError("the splitters of the sector map must ascend on the curve");
  if (owners.empty()) return SectorMap(anchor, std::move(splitters), epoch);
  return SectorMap(anchor, splitters, owners, static_cast<std::uint32_t>(servers), epoch);
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
  const auto after = std::upper_bound(
      splitters_.begin(), splitters_.end(), sector,
      [&](const SectorIndex& a, const SectorIndex& b) { return comes_before_on_curve(a, b, anchor_); });
  const auto run = after - splitters_.begin();
  return owners_.empty() ? static_cast<Rank>(run) : owners_[run];
}

}  // namespace tessera
