// The paper's Fig. 6: the cost of dividing the same bodies among an increasing number of sectors.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// 128 balls roll on a plane in 1, 2, 4, ... 128 sectors, so far from each other and from borders that only
// the number of engine worlds differs. The runs are stepped alternately, tick by tick.
//
// Table "rows": {engine, sectors, bodies, ticks, step_us, ratio, kb_per_sector, hash}. `step_us` is the
// median processor time of a tick, `ratio` relative to one sector; `kb_per_sector` is the heap of the world
// after the run, minus that of an empty world, per sector.
absl::StatusOr<Report> measure_instances(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
