// Finds the cheapest settings with which a world moves as it should, by trying them on that world.
#pragma once

#include "cli/tune/trial.h"

namespace tessera {

struct TuneOptions {
  double max_error = 1e-3;  // m, of any body at any of the samples
  double horizon = 2;       // s
  double max_cost = 0;      // us of processor time by body and simulated second; 0: any
};

// Table "rows": every setting that was tried, by rising cost: {engine, time_step, substeps,
// solver_iterations, error_m, cost_us, own, hash, ratio, meets, front}. `own` are the world's own settings,
// `ratio` is the cost by theirs; `meets`: the error is small enough, and the cost too. Table "chosen": one
// row, the knobs of the cheapest that meets, in a form for knobs_from_json(); none where nothing does. Table
// "trust": {reference_error_m}: how far the reference is from one half as fine. What is below this is not
// known.
//
// Measures in processes of its own, one after the other: call before there are other threads and before an
// engine is loaded. Errors: those of validate() and of loading; CANCELLED.
absl::StatusOr<Report> tune(const WorldDescription& world, const TuneOptions& options,
                            const Progress& progress);

}  // namespace tessera
