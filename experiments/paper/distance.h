// The paper's Fig. 5: the effect of the distance from the origin on a collision.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// Two balls collide at 0 and 2^k m along x. The error is the distance of the worse ball, after 1 s, from its
// position in the scene at the origin.
//
// Table "rows": {system, engine, sector_size, observers, distance_log2, distance_m, whole_sectors, error_m,
// same_bits}; distance_log2 is null at the origin, error_m if a position is not a number. `system` is
//   lpss          sectors of `sector_size` m;
//   one-world     one world with all at absolute coordinates;
//   origin-shift  one world whose origin stays at the first of `observers`, one at the scene or, where there
//   are two,
//                 the first at the origin and the second at the scene.
// Table "inside": {system, engine, sector_size, distance_m, error_m}, distances over three sectors.
//
// Misses: sectors that change a bit at a whole number of sectors, or that are worse inside one than one world
// is anywhere up to half a sector from its origin.
absl::StatusOr<Report> measure_distance(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
