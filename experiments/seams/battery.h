// The whole experiment: every scene in every placement under every policy, compared with its run without a
// seam.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cli/measure/report.h"
#include "experiments/seams/course.h"
#include "experiments/seams/hashes.h"
#include "experiments/seams/scene.h"
#include "experiments/seams/stage.h"

namespace tessera::seams {

struct BatteryOptions {
  std::vector<Scene> scenes;
  std::vector<Placement> placements;
  std::vector<Policy> policies;
  Precision precision = Precision::kFloat32;
  int references_elsewhere = kReferencesElsewhere;  // for the noise
  HashOptions hashes;
};

// A run on servers in separate processes.
struct RemoteRun {
  std::string world_hash;
  double tick_ms = 0;                // median, of the slowest server
  std::uint64_t exchange_bytes = 0;  // between the servers, in the measured ticks
  double contacts = 0;               // mean of the measured ticks
  std::uint64_t islands_shipped = 0;
};

// Runs a world on two servers for `ticks` ticks, the first `unmeasured` of which do not count.
using RunRemotely =
    std::function<absl::StatusOr<RemoteRun>(const WorldDescription& world, Tick ticks, Tick unmeasured)>;

struct Row {
  std::string scene;
  Placement placement = Placement::kReference;
  Policy policy = Policy::kIsland;
  bool stands = false;
  double max_error_m = 0;  // after 1 s, against the reference
  double end_error_m = 0;  // at the end
  double top_error_m = 0;  // of the highest body's height at the end
  bool asleep = false;     // all bodies, at the end
  Course course;           // without its samples; if the placement is remote, of the run in this process
  std::optional<bool> same_bits;  // remote: whether the servers ended in the same hash
};

struct Noise {
  std::string scene;
  double error_m = 0;
};

struct Results {
  std::vector<Row> rows;
  std::vector<Noise> noise;
  std::vector<Equality> equalities;
};

// Adds to `results` as it goes, so that they have what is done where it ends early. Errors: CANCELLED; those
// of runs; NOT_FOUND, INVALID_ARGUMENT of world files.
absl::Status run_battery(const BatteryOptions& options, const RunRemotely& run_remotely,
                         const Progress& progress, Results& results);

}  // namespace tessera::seams
