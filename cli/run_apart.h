// A scenario of `simulate` in a process of its own, which may end.
#pragma once

#include <absl/status/statusor.h>

#include <functional>

#include "simulator/scenario.h"

namespace tessera::cli {

// Calls `run` in a copy of this process, which must have one thread, and returns what that returns: ABORTED
// if the copy ends by a signal, or takes more than an hour of processor time. UNAVAILABLE where there can be
// no copy.
absl::StatusOr<ScenarioReport> run_apart(const std::function<absl::StatusOr<ScenarioReport>()>& run);

}  // namespace tessera::cli
