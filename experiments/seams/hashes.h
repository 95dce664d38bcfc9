// Whether the bits are the same however the work is distributed, for each scene.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>

#include "experiments/seams/scene.h"
#include "experiments/seams/stage.h"

namespace tessera::seams {

struct HashOptions {
  int seeds = 100;   // of simulated networks
  int shuffles = 5;  // with random owners of sectors and islands
  Tick ticks = 120;
  Tick ticks_heavy = 20;
};

// The number of runs of the scene, at the corner of eight sectors, that ended in the same bits as one
// process.
struct Equality {
  std::string scene;
  Policy policy = Policy::kIsland;
  Tick ticks = 0;
  std::string world_hash;  // of one process
  int seeds = 0;           // whole clusters of 3 servers on a simulated network
  int seeds_equal = 0;
  int shuffles = 0;  // 4 partitions whose sectors and islands move every few ticks
  int shuffles_equal = 0;
  bool ten_partitions_equal = false;

  bool holds() const { return seeds_equal == seeds && shuffles_equal == shuffles && ten_partitions_equal; }
};

// Errors: those of runs.
absl::StatusOr<Equality> compare_hashes(const Scene& scene, Policy policy, Precision precision,
                                        const HashOptions& options);

}  // namespace tessera::seams
