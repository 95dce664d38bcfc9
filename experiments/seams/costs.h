// The cost of the policies: time per tick, and bytes between servers.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <vector>

#include "experiments/seams/battery.h"

namespace tessera::seams {

// Paired: the worlds are stepped alternately, tick by tick, in the same process on one thread.
struct TimeCost {
  std::string world;
  std::string policy;  // "plain": one Bullet world without sectors
  Tick ticks = 0;
  double tick_ms = 0;  // median
  std::string hash;    // of the result; that of "plain" differs, since it has no sectors
};

// On two servers.
struct SeamCost {
  std::string world;
  Tick ticks = 0;
  double tick_ms = 0;  // median, of the slower server
  double bytes_per_tick = 0;
  double bytes_per_tick_and_contact = 0;
  double contacts = 0;
  std::string hash;
};

struct Costs {
  std::vector<TimeCost> times;
  std::vector<SeamCost> seams;
};

struct CostOptions {
  Precision precision = Precision::kFloat32;
  std::string worlds;  // folder of $TESSERA_WORLDS; empty: without 3k_shapes.sdf
  int pile = 2000;     // bodies
  Tick ticks = 300;
};

// Adds to `costs` as it goes. Errors: CANCELLED; those of runs.
absl::Status measure_costs(const CostOptions& options, const RunRemotely& run_remotely,
                           const Progress& progress, Costs& costs);

}  // namespace tessera::seams
