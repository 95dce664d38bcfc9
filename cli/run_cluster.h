// A run on a cluster of its own: started, loaded, stepped, asked, and shut down.
#pragma once

#include <absl/status/statusor.h>

#include "cli/run_report.h"

namespace tessera::cli {

// Leaves no process and no shared memory behind, also where it fails or is interrupted (CANCELLED).
absl::StatusOr<RunReport> run_cluster(const RunOptions& options);

}  // namespace tessera::cli
