// The savings of computing only what a scene requires, and the remaining error.
#pragma once

#include <span>
#include <string>

#include "experiments/catalogue.h"
#include "lpss/model/world_description.h"

namespace tessera {

// Worlds with each automatic choice (choices.h), and without it: worlds/earth.sdf of the working directory, a
// sparse world of 10,000 lone bodies, and gazebo/3k_shapes.sdf of `options.worlds`. All are stepped
// alternately, tick by tick, in one process and on one thread, with the time step of the defaults.
//
// Table "rows": {world, choice, engine, cpu_us_on, cpu_us_off, saving, saving_at_end, peak_kb_on,
// peak_kb_off, error_m, hash_on, hash_off}. "on" is with all choices, "off" without this one. `cpu_us` is
// processor time by body and simulated second, `saving` "off" by "on", `saving_at_end` that of the last
// second alone (where all sleeps by then, of "sleep" only). `peak_kb` is what a process of its own takes at
// most for the world and its first ticks, by body. `error_m` is how far a body is at most from itself in the
// other run after the horizon. Hashes are those of the end.
//
// Table "errors": {world, choice, engine, body, error_m, noise_m, error_at_rest_m, noise_at_rest_m,
// to_reference_on_m, to_reference_off_m, reference_error_m}, of the `body` in the middle ("median") and of
// the one that is worst ("largest"). `error_m` as above, `error_at_rest_m` likewise at the end, of the bodies
// that sleep then (null: none does). `noise` is what these come to where every body starts 10 um beside its
// place, all else being the same. `to_reference` is how far a body is after the horizon from a far finer run
// in double precision, `reference_error_m` how far that run is from one half as fine.
//
// Table "worlds": {world, engine, bodies, asleep, sectors, seconds, horizon_s, cost_of_same}. `asleep` are
// those that sleep at the end; `cost_of_same` is the cost of the disturbed run by "on": how far from 1 a
// saving is that is none.
//
// What is left out is among the misses, and so is a coast that changes a bit of a world that has no orbits.
absl::StatusOr<Report> measure_requirements(const ExperimentOptions& options, const Progress& progress);

struct RequirementsSubject {
  std::string name;
  WorldDescription world;  // valid
  double seconds = 1;      // of the whole run
  double horizon = 0.5;    // s, at most as long
};

// The same for other worlds.
absl::StatusOr<Report> measure_requirements_of(std::span<const RequirementsSubject> subjects,
                                               const Progress& progress);

}  // namespace tessera
