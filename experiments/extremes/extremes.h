// The ends of what can be asked for: distances, masses, sizes, speeds, spins, time steps, heights, inputs,
// ages.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// Each scene (extremes/scene.h) runs in a process of its own, so that a crash or an endless loop is a row as
// well.
//
// Table "rows": {group, scene, engine, what, figure, unit, bound, within, ticks, wall_s}. `what` says what
// happened, in a sentence; `figure` is null where it is no number, or where there was none to measure.
//
// Misses: rows with `within` false.
absl::StatusOr<Report> measure_extremes(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
