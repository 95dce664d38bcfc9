// Measures one scene.
#pragma once

#include "experiments/catalogue.h"
#include "experiments/extremes/scene.h"

namespace tessera::extremes {

// A row of the table "rows" (extremes.h), and a miss where its figure is beyond its bound. An error of the
// world becomes a row, too; a broken invariant of the engine ends the process.
Report measure(const Scene& scene, const ExperimentOptions& options);

// The same in a process of its own, whose crash becomes a row, and so does an end by the limit on its
// processor time (60 s; 8 s where quick). Call before there are other threads.
Report measure_apart(const Scene& scene, const ExperimentOptions& options);

}  // namespace tessera::extremes
