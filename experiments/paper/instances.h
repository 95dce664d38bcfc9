// The paper's Fig. 6: the cost of dividing the same bodies among more and more sectors.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// 128 balls that roll on a plane in 1, 2, 4, ... 128 sectors, far enough from each other and from borders
// that only the number of engine worlds differs. The runs are stepped alternately, tick by tick.
//
// Table "rows": {engine, sectors, bodies, ticks, step_us, ratio, kb_per_sector, hash}. `step_us` is the
// median of a tick, `ratio` that to one sector; `kb_per_sector` is the heap that the world holds after the
// run, less that of an empty world, by its sectors.
absl::StatusOr<Report> measure_instances(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
