// Crowds that cross a world, on servers that share its sectors.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>

#include "cli/measure/report.h"
#include "coordinator/balance_policy.h"
#include "lpss/model/world_description.h"
#include "lpss/tick/messages.h"

namespace tessera {

struct CrowdOptions {
  Precision precision = Precision::kFloat32;
  int bodies = 5000;
  Tick ticks = 720;
};

// Balls of 0.3 m, close together, roll at 3 m/s over a plain of 10 x 10 sectors of 5 m, from one corner
// towards the other. A heavy box stands in each sector, so that all are there from the start.
WorldDescription crowd_world(const CrowdOptions& options);

// The same balls walk along a road of 100 sectors of 5 m, six abreast, of which each has a box, too: at 0.8
// m/s, which a slope of 3 degrees and a drag that grows with the speed hold for as long as the road goes on.
// It takes ten minutes, kWalkTicks.
WorldDescription walk_world(const CrowdOptions& options);
inline constexpr Tick kWalkTicks = 36'000;

struct CrowdRun {
  std::string hash;       // after CrowdOptions::ticks, and as many more as the servers were ahead
  double largest_ms = 0;  // own work of the slowest server of each tick: mean
  double mean_ms = 0;     // own work of a server and tick: mean
  double largest_p99_ms = 0;
  std::uint64_t late = 0;  // ticks that took longer, with all waiting, than there is for one at kCrowdPace
  double real_time_factor = 0;  // that was reached
  std::uint64_t moves = 0;      // changes of the map
  std::uint64_t moved_sectors = 0;
  std::uint64_t moved_bodies = 0;
  double moved_kb = 0;
  double exchanged_kb = 0;  // between servers, a tick, without what moved
};

// Real time is too slow for four servers to be late.
inline constexpr double kCrowdPace = 1.5;

// How its sectors are shared out.
struct Sharing {
  BalancePolicy policy = BalancePolicy::kCurve;
  double every = 0;  // s; 0: as at the load
  double ahead = 0;  // s
};

// Runs the world at kCrowdPace times real time on four servers and a coordinator, whose production code
// shares one thread on a simulated network of one rack (50 to 100 us a message, whatever its length): each
// server takes the processor time of what it does, as if it had a processor of its own. Errors: CANCELLED
// where `go_on` says so, those of the world.
absl::StatusOr<CrowdRun> run_crowd(const WorldDescription& world, Tick ticks, const Sharing& sharing,
                                   const std::function<bool()>& go_on);

}  // namespace tessera
