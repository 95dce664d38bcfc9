// The cost of each setting, and the remaining error.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// Small scenes (collision, stack, pile, chain, vehicle, orbit, rolling) under many settings: each one changed
// alone from the defaults (the "knob"), and the grid of time steps, substeps and passes.
//
// Table "rows": {scene, engine, knob, value, time_step, substeps, solver_iterations, error_m, overlap_m,
// speed_m_s, cost_us, ratio, front, hash}. `error_m` is the worst body's distance from a much finer run in
// double precision; for the pile, whose motion is chaotic, the deepest overlap. `cost_us` is processor time
// per body and simulated second, `ratio` relative to plain Bullet in one world with its own solver at the
// same time step, in the same process (null for scenes with joints, which the plain world lacks). `front`: no
// other row of the scene is both cheaper and more accurate. Table "prices": {scene, engine, knob, value,
// error_ratio, cost_ratio}, relative to the defaults. Table "trust": {scene, reference_error_m}: the distance
// of the reference from one half as fine.
absl::StatusOr<Report> measure_tradeoff(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
