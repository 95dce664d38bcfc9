// What all runs begin with.
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "cli/run_report.h"
#include "cli/trajectory.h"

namespace tessera::cli {

using Clock = std::chrono::steady_clock;

inline double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// A world as the options want it, and the report with all that is known before the first tick.
struct PreparedRun {
  Clock::time_point begin;  // of the loading
  LoadedWorld loaded;       // empty where there is a snapshot
  std::optional<ReadSnapshot> snapshot;
  std::unique_ptr<Trajectory> trajectory;  // to be written; null: none
  RunReport report;
};

// Reads the world file and applies the overrides, or reads the snapshot, counts the ticks, and begins the
// trajectory. Errors as load_world(), read_snapshot(), from_chunks(), ticks_of() and Trajectory::open();
// INVALID_ARGUMENT for overrides of a snapshot.
absl::StatusOr<PreparedRun> prepare(const RunOptions& options, const std::string& mode);

}  // namespace tessera::cli
