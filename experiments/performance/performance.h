// What a core does: piles, towers, a pyramid and mixed bodies, each beside plain Bullet in the same run.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// One thread. The worlds of a scene are stepped alternately, 25 ticks at a time: in sectors of 16 m, in one
// sector, and as one plain Bullet world with two friction directions.
//
//   pile          8,192 boxes dropped in 4 layers, 1.1 m apart, a little out of line; never asleep
//   pile_to_rest  the same for 10 s, with sleep
//   towers        800 towers of 10; never asleep
//   pyramid       30 rows, 465 boxes 1.05 m apart; never asleep
//   bin_KIND      4,096 balls, capsules, boxes, cylinders, or all of these and hulls, poured into a bin: on a
//                 floor, and some on hills of 28,800 triangles of 2 m, and on 100,352 of 0.27 m; never asleep
//   mixed         2,800 hulls, capsules, boxes, balls and chains of three on hills; never asleep. Plain
//                 Bullet takes part twice: in ticks, and in 16 steps a tick
//
// Table "rows": {engine, scene, world, bodies, ticks, tick_us, ratio, drift_m, gap_mm, hash}. `tick_us` is
// the mean of processor times of ticks, `ratio` relative to plain Bullet; `drift_m` is the horizontal way of
// the body that comes farthest from its start, `gap_mm` the largest of a joint at the end of a tick, if there
// are joints. Plain hashes are not to be compared with the others.
absl::StatusOr<Report> measure_performance(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
