// The paper's Fig. 5: the effect of the distance from the origin on a collision.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// Two balls collide at 0 and 2^k m along x. The error is the larger distance of a ball, after 1 s, from its
// position in the scene at the origin.
//
// Table "rows": {system, engine, sector_size, observers, distance_log2, distance_m, whole_sectors, error_m,
// same_bits}; distance_log2 is null at the origin, error_m if a position is not a number. `system` is
//   lpss          sectors of `sector_size` m;
//   one-world     one world with absolute coordinates;
//   origin-shift  one world with its origin at the first of `observers`: of one, at the scene; of two, the
//                 first is at the origin and the second at the scene.
// Table "inside": {system, engine, sector_size, distance_m, error_m}, distances over three sectors.
//
// Misses: sectors with a different result at a whole number of sectors, or a larger error inside a sector
// than one world has up to half a sector from its origin.
absl::StatusOr<Report> measure_distance(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
