// Engine worlds of the static bodies around sectors in which nothing lives, which have none of their own:
// made for queries, and kept for the next ones.
#pragma once

#include <absl/container/flat_hash_map.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>

#include "lpss/partition/partition.h"

namespace tessera {

// So many are kept: those that were asked last.
inline constexpr std::size_t kPassingWorldsMax = 64;

class PassingWorlds {
 public:
  // nullptr if no static body meets `region` (m, relative to the sector's centre). The world stays valid
  // until the next call.
  const SectorWorld* at(const Partition& partition, const SectorIndex& index,
                        const Eigen::AlignedBox3d& region);

 private:
  struct Entry {
    Sector sector;
    std::uint64_t asked = 0;  // in the order of calls
  };

  void make_room();

  absl::flat_hash_map<SectorIndex, std::unique_ptr<Entry>> entries_;
  std::uint64_t calls_ = 0;
  std::uint64_t revision_ = 0;  // of the static bodies
};

// What a sector's engine world knows of, relative to the sector's centre.
Eigen::AlignedBox3d surroundings(const Partition& partition);

}  // namespace tessera
