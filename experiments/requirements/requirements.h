// The savings of computing only what a scene requires, and the remaining error.
#pragma once

#include <span>
#include <string>

#include "experiments/catalogue.h"
#include "lpss/model/world_description.h"

namespace tessera {

// Worlds with and without each automatic choice (choices.h): worlds/earth.sdf of the working directory, a
// sparse world of 10,000 lone bodies, and gazebo/3k_shapes.sdf of `options.worlds`. All are stepped
// alternately, tick by tick, in one process on one thread, with the default time step.
//
// Table "rows": {world, choice, engine, cpu_us_on, cpu_us_off, saving, saving_at_end, peak_kb_on,
// peak_kb_off, error_m, hash_on, hash_off}. "on" is with all choices, "off" without this one. `cpu_us` is
// processor time per body and simulated second, `saving` the quotient "off" / "on", `saving_at_end` that of
// the last second alone (only for "sleep" if all bodies sleep by then). `peak_kb` is the peak memory per body
// of a separate process for the world and its first ticks. `error_m` is the largest distance between a body's
// positions in both runs after the horizon. Hashes are those at the end.
//
// Table "errors": {world, choice, engine, body, error_m, noise_m, error_at_rest_m, noise_at_rest_m,
// to_reference_on_m, to_reference_off_m, reference_error_m}, the "median" and the "largest" over all bodies
// (`body`). `error_m` as above, `error_at_rest_m` likewise at the end, for bodies asleep then (null: none).
// `noise` is the same for a run in which every body starts 10 um off its position. `to_reference` is the
// distance of a body after the horizon from a much finer run in double precision, `reference_error_m` the
// distance of that run from one half as fine.
//
// Table "worlds": {world, engine, bodies, asleep, sectors, seconds, horizon_s, cost_of_same}. `asleep` counts
// bodies asleep at the end; `cost_of_same` is the cost of the disturbed run relative to "on": the measurement
// noise of a saving.
//
// Misses: skipped worlds, and a world without orbits in which "coast" changes a bit.
absl::StatusOr<Report> measure_requirements(const ExperimentOptions& options, const Progress& progress);

struct RequirementsSubject {
  std::string name;
  WorldDescription world;  // valid
  double seconds = 1;      // of the whole run
  double horizon = 0.5;    // s, at most `seconds`
};

// The same for given worlds.
absl::StatusOr<Report> measure_requirements_of(std::span<const RequirementsSubject> subjects,
                                               const Progress& progress);

}  // namespace tessera
