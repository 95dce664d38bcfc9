// What a second thread and a second server give.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// The worlds of a scene are stepped alternately, a few ticks at a time: in one process on one thread and on
// two, on one server and on two of a thread each, and on one and on two of which the map follows the load.
// Nothing sleeps. `--only threads` needs no servers.
//
//   pile, pile in one sector   8,192 boxes dropped in 4 layers; sectors of 16 m and of 512 m
//   towers                     800 towers of 10 in sectors of 16 m
//   pyramid                    30 rows in sectors of 8 m: one island
//
// Table "rows": {engine, scene, sector_size, what, ticks_before, ticks, one_ms, two_ms, speedup,
// machine_speedup, same_bits, kilobytes_per_tick, hash}. `what` is "threads", "servers" or "servers, map
// follows"; times are means of a tick, by the clock of the wall, after `ticks_before`; `kilobytes_per_tick`
// is what two servers sent each other; `machine_speedup` is that of loops that share nothing on two threads,
// measured in between.
absl::StatusOr<Report> measure_scaling(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
