// What each knob costs, and what error it leaves.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// Small scenes (collision, stack, pile, chain, vehicle, orbit, rolling) under many settings: each knob turned
// alone from the product's defaults, and the grid of time steps, small steps and passes.
//
// Table "rows": {scene, engine, knob, value, time_step, substeps, solver_iterations, error_m, overlap_m,
// speed_m_s, cost_us, ratio, front, hash}. `error_m` is the worst body's distance from a far finer run in
// double precision; of the pile, whose motion nothing predicts, the deepest overlap. `cost_us` is processor
// time by body and simulated second, `ratio` that to plain Bullet in one world with its own solver at the
// same time step, in the same process (null where there are joints, which the plain world has not). `front`:
// no other row of the scene is cheaper and better. Table "prices": {scene, engine, knob, value, error_ratio,
// cost_ratio}: of one knob turned, by the defaults. Table "trust": {scene, reference_error_m}: how far the
// reference is from one half as fine.
absl::StatusOr<Report> measure_tradeoff(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
