// The limits of the input range: distances, masses, sizes, speeds, spins, time steps, heights, inputs, ages.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// Each scene (extremes/scene.h) runs in a process of its own, so that a crash or an endless loop also becomes
// a row.
//
// Table "rows": {group, scene, engine, what, figure, unit, bound, within, ticks, wall_s}. `what` describes in
// a sentence what happened, and names what the number format adds to a bound where that is needed; `figure`
// is null if it is not a number or could not be measured.
//
// Misses: rows with `within` false.
absl::StatusOr<Report> measure_extremes(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
