// The paper's Fig. 8: towers near and far from the origin.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// A tower of ten boxes at 0, 2^24, 2^40 and 2^53 m and at 2^62 sectors from the origin along each axis, in
// one world and in sectors, after 10 s.
//
// Table "rows": {system, engine, place, distance_m, top_m, moved_max_m, stands, same_bits}. `top_m` is the
// height of the highest box, `moved_max_m` the largest distance of a box from its start; null if a position
// is not a number. A tower stands if no box has moved by half a box. Table "edges": {system, engine, place,
// box, x, z}: the edges of each box in a view along y, in m from the foot of the tower, as lines of two
// points; for the picture.
//
// Misses: a tower in sectors that differs from the one at the origin in any bit.
absl::StatusOr<Report> measure_stacks(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
