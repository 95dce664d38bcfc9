// What clients get from a cluster: commands and queries a second, latencies, steps in lock step.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// Two servers of one thread each, without a store; all processes share the cores. Worlds run at 60 Hz but for
// lock step.
//
//   one by one     a thread sends lists of a command, each when the one before is acknowledged
//   on a stream    likewise without waiting, from 1 and from 16 clients; and in lists of 100
//   effect         from sending a command to knowing a state that it has changed
//   rays           in lists of 1, 100 and 1,000 down on hills
//   game server    500 characters, each with a ray down and a velocity in each tick, in one message
//   lock step      robots with 8 and 800 hinges: targets of servos, a tick, the positions of all joints
//
// Table "rows": {engine, scene, clients, list, calls, per_second, p50_ms, p99_ms, hash}. `list`: commands or
// queries in a message; `per_second`: these, or ticks in lock step; p50_ms, p99_ms: of a call, for how long
// its client waits; `hash`: of the world where its ticks are those of the client.
absl::StatusOr<Report> measure_clients(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
