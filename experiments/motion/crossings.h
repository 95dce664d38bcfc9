// Bodies and islands that pass through a frame that moves.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// 1,250 bodies (quick: 120) and 125 pairs that a joint holds (quick: 12) fly into the region of a frame and
// out of it on the other side, without gravity; the frame goes at `speed` (m/s) and turns by `spin` (rad/s).
//
// Table "crossings": {engine, speed, spin, bodies, pairs, crossings, lost, parted, jump, momentum, same}: how
// often a body changed its frame; bodies that are not there at the end, and ticks in which a pair was in two
// frames; the largest distance (m) between where a body is seen from outside after a tick in which it changed
// its frame and where it was going to be, and the largest change of its momentum in it, as a part of it;
// whether the hash is the same at every tick in two and four partitions.
absl::StatusOr<Report> measure_crossings(const ExperimentOptions& options, double speed, double spin);

}  // namespace tessera
