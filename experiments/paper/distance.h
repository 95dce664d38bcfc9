// The paper's Fig. 5: what the distance from the origin does to a collision.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// Two balls collide at 0 and 2^k m along x; after 1 s, how far is the worst of them from where it is at the
// origin?
//
// Table "rows": {system, engine, sector_size, observers, distance_log2, distance_m, whole_sectors, error_m,
// same_bits}; distance_log2 is null at the origin, error_m where a position is no number. `system` is
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
