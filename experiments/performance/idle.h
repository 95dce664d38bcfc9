// What sectors cost in which everything sleeps.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// 1,000 balls that roll, beside up to a million sectors (quick: 100,000) with one sleeping box each, on one
// ground; one thread. The worlds are stepped alternately.
//
// Table "rows": {engine, idle_sectors, awake_bodies, ticks, step_us, ratio, bytes_per_sector, hash}: the
// median of the processor time of a tick, its ratio to that without idle sectors, and heap memory.
//
// And a world that grows, by commands, to ten million boxes (quick: 100,000), ten in a sector, of which each
// comes to rest; then 10,000 balls (quick: 1,000) roll. Table "grown": {engine, bodies, awake_bodies,
// tick_us, wake_us, heap_mb, heap_mb_max, bytes_per_body, hash}: the median of the processor time of a tick,
// that of waking one sector by a push to one of its boxes, heap memory in the end and at most, and that by
// bodies.
absl::StatusOr<Report> measure_idle(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
