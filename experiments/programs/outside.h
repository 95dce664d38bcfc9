// A crowd that decides inside the tick, and outside of it.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// 500 characters that wander, beside two servers of one thread each: as programs, and as the code of a client
// that sees all of them, casts a ray under each, and sets its velocity, in one message a tick.
//
// Table "rows": {engine, deciders, pace, ticks, ticks_per_second, p50_ms, p99_ms, sense_to_act_ticks,
// network_bytes_per_tick}. `pace` is "as fast as it goes", where a paused world is stepped, or "60 Hz"; p50
// and p99 are the times of a call; `sense_to_act_ticks` is the median from the tick that was sensed to the
// one that acts. `network_bytes_per_tick` is all that crosses the loopback interface, whoever sends it:
// nothing else should run.
absl::StatusOr<Report> measure_outside(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
