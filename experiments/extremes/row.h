// Measures one scene.
#pragma once

#include "experiments/catalogue.h"
#include "experiments/extremes/scene.h"

namespace tessera::extremes {

// A row of the table "rows" (extremes.h), and a miss if its figure exceeds its bound. An error of the world
// also becomes a row; a broken invariant of the engine ends the process.
Report measure(const Scene& scene, const ExperimentOptions& options);

// The same in a separate process: a crash becomes a row, and so does exceeding the limit on processor time
// (60 s). Call before there are other threads.
absl::StatusOr<Report> measure_apart(const Scene& scene, const ExperimentOptions& options);

}  // namespace tessera::extremes
