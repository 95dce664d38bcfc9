// Finds a smaller scenario that fails, too.
#pragma once

#include <absl/status/status.h>

#include <functional>

#include "simulator/scenario.h"

namespace tessera {

struct Shrunk {
  Scenario scenario;
  absl::Status failure;  // of it
  int tries = 0;
};

// `run` runs a scenario: ABORTED means that it fails; any other error ends the search. `scenario` has failed
// with `failure`. Fewer faults, fewer commands, fewer ticks and fewer servers are tried, as long as that
// helps and at most `tries_max` times.
Shrunk shrink(const Scenario& scenario, const absl::Status& failure,
              const std::function<absl::Status(const Scenario&)>& run, int tries_max);

}  // namespace tessera
