// Which server hosts which sector: the global sector hash, as a rule that every process can evaluate.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "lpss/grid/curve.h"
#include "lpss/grid/sector_index.h"

namespace tessera {

// The place of a server in the list of servers of a world, 0 to n-1.
using Rank = std::uint32_t;

// So many runs has a map whose runs have owners. Each is sent to every server, and looked through for every
// owner.
inline constexpr std::size_t kMapRunsMax = 4096;

// Sectors in the order of a space-filling curve (Morton), cut into runs, each with a server that owns it: one
// run per server, so that what is near in the world is mostly on one server, or any other division of the
// curve. Every sector has an owner at any time, also those that do not exist yet: a body that enters an empty
// sector needs nobody's permission.
class SectorMap {
 public:
  SectorMap() = default;

  // One run per server. `splitters`, ascending on the curve, are the first sectors of the runs of ranks 1, 2,
  // ...; `anchor` is the sector that the curve is laid around. `epoch` counts the versions of a world's map.
  SectorMap(const SectorIndex& anchor, std::vector<SectorIndex> splitters, std::uint64_t epoch);

  // Runs with owners: one more than splitters, each < `servers`. Runs without sectors are left out, and
  // neighbours of one owner become one; at most kMapRunsMax remain.
  SectorMap(const SectorIndex& anchor, const std::vector<SectorIndex>& splitters,
            const std::vector<Rank>& owners, std::uint32_t servers, std::uint64_t epoch);

  // The same of what comes from elsewhere; without owners, there must be one run per server.
  // INVALID_ARGUMENT, naming what is wrong, where it is no such map, or has more than kMapRunsMax runs.
  static absl::StatusOr<SectorMap> checked(const SectorIndex& anchor, std::vector<SectorIndex> splitters,
                                           const std::vector<Rank>& owners, std::size_t servers,
                                           std::uint64_t epoch);

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
  // Of the runs; empty where there is one per server, in the order of ranks.
  const std::vector<Rank>& owners() const { return owners_; }
  std::uint64_t epoch() const { return epoch_; }
  std::uint32_t servers() const { return servers_; }

 private:
  SectorIndex anchor_;
  std::vector<SectorIndex> splitters_;
  std::vector<Rank> owners_;
  std::uint32_t servers_ = 1;
  std::uint64_t epoch_ = 0;
  std::uint64_t scatter_ = 0;  // not 0: the seed of a scattered map
};

// A well-mixed function of a number (splitmix64): random choices that all processes make alike.
std::uint64_t scrambled(std::uint64_t x);

}  // namespace tessera
