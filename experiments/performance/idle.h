// What sectors cost in which everything sleeps.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// 1,000 balls that roll, beside up to a million sectors (quick: 100,000) with one sleeping box each, on one
// ground; one thread. The worlds are stepped alternately.
//
// Table "rows": {engine, idle_sectors, awake_bodies, ticks, step_us, ratio, bytes_per_sector, hash}: the
// median of the processor time of a tick, its ratio to that without idle sectors, and heap memory.
absl::StatusOr<Report> measure_idle(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
