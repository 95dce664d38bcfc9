// What all runs begin with.
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <optional>
#include <string>

#include "cli/run_report.h"

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
  RunReport report;
};

// Reads the world file and applies the overrides, or reads the snapshot, and counts the ticks. Errors as
// load_world(), read_snapshot(), from_chunks() and ticks_of(); INVALID_ARGUMENT for overrides of a snapshot.
absl::StatusOr<PreparedRun> prepare(const RunOptions& options, const std::string& mode);

}  // namespace tessera::cli
