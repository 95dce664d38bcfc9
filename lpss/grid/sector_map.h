// Which server hosts which sector: the global sector hash, as a rule that every process can evaluate.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "lpss/grid/sector_index.h"

namespace tessera {

// The place of a server in the list of servers of a world, 0 to n-1.
using Rank = std::uint32_t;

// Sectors in the order of a space-filling curve (Morton), cut into one run per server, so that what is near
// in the world is mostly on one server. Every sector has an owner at any time, also those that do not exist
// yet: a body that enters an empty sector needs nobody's permission.
class SectorMap {
 public:
  SectorMap() = default;

  // `splitters`, ascending on the curve, are the first sectors of the runs of ranks 1, 2, ...; `anchor` is
  // the sector that the curve is laid around. `epoch` counts the versions of a world's map.
  SectorMap(const SectorIndex& anchor, std::vector<SectorIndex> splitters, std::uint64_t epoch);

  // The same of splitters from elsewhere. INVALID_ARGUMENT unless they ascend, and make `servers` runs.
  static absl::StatusOr<SectorMap> checked(const SectorIndex& anchor, std::vector<SectorIndex> splitters,
                                           std::size_t servers, std::uint64_t epoch);

  // Cuts the curve so that each of `servers` gets about the same sum of weights. `load` lists occupied
  // sectors and what they weigh (> 0), in any order.
  static SectorMap balanced(const SectorIndex& anchor, std::vector<std::pair<SectorIndex, double>> load,
                            std::uint32_t servers, std::uint64_t epoch);

  // Every sector on a server of its own, drawn from `seed`: no neighbourhood is kept. For tests of authority
  // that moves at random.
  static SectorMap scattered(const SectorIndex& anchor, std::uint32_t servers, std::uint64_t seed,
                             std::uint64_t epoch);

  Rank owner(const SectorIndex& sector) const;

  const SectorIndex& anchor() const { return anchor_; }
  const std::vector<SectorIndex>& splitters() const { return splitters_; }
  std::uint64_t epoch() const { return epoch_; }
  std::uint32_t servers() const { return servers_; }

 private:
  SectorIndex anchor_;
  std::vector<SectorIndex> splitters_;
  std::uint32_t servers_ = 1;
  std::uint64_t epoch_ = 0;
  std::uint64_t scatter_ = 0;  // not 0: the seed of a scattered map
};

// A well-mixed function of a number (splitmix64): random choices that all processes make alike.
std::uint64_t scrambled(std::uint64_t x);

// Whether `a` comes before `b` on the Morton curve around `anchor`.
bool comes_before_on_curve(const SectorIndex& a, const SectorIndex& b, const SectorIndex& anchor);

}  // namespace tessera
