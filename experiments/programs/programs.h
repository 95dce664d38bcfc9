// What programs cost.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// Crowds of characters that stand, walk, and wander, cars, and lifts, in one process with one thread.
//
// Table "rows": {engine, scene, instances, ticks, tick_us, programs_us, us_per_instance, hash, program_hash}.
// `tick_us` and `programs_us` are the medians of the time of a tick and of its phase `programs`, casts
// included; `us_per_instance` is the latter by the instances that ran.
absl::StatusOr<Report> measure_programs(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
