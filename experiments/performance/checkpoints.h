// What it costs that a world survives the loss of a process.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// A world on two servers of a thread each, once without checkpoints and once for each of several intervals,
// with processes of their own; they are stepped in turn, some hundred or thousand ticks at a time, as fast as
// they go. States go to a store on disk.
//
//   pile       8,192 boxes dropped in 4 layers, all awake
//   resting    the same, asleep in the end, beside 500 balls that roll
//
// Table "rows": {engine, scene, bodies, every_s, ticks, tick_ms, checkpoints, percent, ms_per_checkpoint,
// coordinator_ms_per_checkpoint, bytes_per_body, same_bits, hash}. `tick_ms` is the mean of a tick, by the
// clock of the wall; `percent` what it takes more than without checkpoints, `coordinator_ms_per_checkpoint`
// what the coordinator takes more of its processor; `checkpoints` are those that were seen, at most one in 25
// ticks; `bytes_per_body` is the size of a snapshot by the number of bodies.
absl::StatusOr<Report> measure_checkpoints(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
