// Runs scenes in this process and compares them.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "experiments/seams/course.h"
#include "experiments/seams/scene.h"
#include "experiments/seams/stage.h"

namespace tessera::seams {

// Errors: those of stage() and of Simulation::create().
absl::StatusOr<Course> run(const Scene& scene, const Stage& stage, Tick ticks);

// The effect of rounding alone: the largest distance (m) after 1 s between the reference and the same scene
// at `places` other places inside one sector.
absl::StatusOr<double> noise(const Scene& scene, const Course& reference, Precision precision, int places);

}  // namespace tessera::seams
