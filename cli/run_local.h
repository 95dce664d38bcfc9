// Runs without any daemon: in this process, on Tessera's layer or on one plain Bullet world.
#pragma once

#include <absl/status/statusor.h>

#include "cli/run_report.h"

namespace tessera::cli {

// Loads and steps the world on one share. An interrupt ends it with CANCELLED.
absl::StatusOr<RunReport> run_in_process(const RunOptions& options);

// The same world and time in one engine world of single precision at absolute coordinates; only `towers` and
// what does not concern sectors is meaningful in the report.
absl::StatusOr<RunReport> run_plain(const RunOptions& options);

}  // namespace tessera::cli
