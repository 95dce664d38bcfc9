// What the tests of partitions have in common: clusters of them, and runs held against each other tick by
// tick.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "lpss/simulation/partition_cluster.h"

namespace tessera {

inline WorldSettings sectors_of(double size, SeamPolicy seams = SeamPolicy::kIsland) {
  WorldSettings settings;
  settings.sector_size = size;
  settings.seams = seams;
  return settings;
}

inline std::unique_ptr<PartitionCluster> cluster_of(const WorldDescription& world, std::uint32_t partitions,
                                                    int threads = 1) {
  auto cluster = PartitionCluster::create(world, partitions, threads);
  EXPECT_TRUE(cluster.ok()) << cluster.status();
  return std::move(*cluster);
}

// The hash after each tick, after which every partition must be consistent.
inline std::vector<WorldHash> run(const WorldDescription& world, std::uint32_t partitions, int threads,
                                  int ticks) {
  auto cluster = cluster_of(world, partitions, threads);
  std::vector<WorldHash> hashes;
  for (int t = 0; t < ticks; ++t) {
    cluster->step();
    for (Rank rank = 0; rank < partitions; ++rank) check_invariants(cluster->partition(rank));
    hashes.push_back(cluster->hash());
  }
  return hashes;
}

inline std::size_t first_difference(const std::vector<WorldHash>& a, const std::vector<WorldHash>& b) {
  std::size_t tick = 0;
  while (tick < a.size() && a[tick] == b[tick]) ++tick;
  return tick;
}

}  // namespace tessera
