// How joints hold, swing and are driven: every type, chains, loops and drives, beside Bullet's own joints.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// Each mechanism (experiments/joints/mechanism.h) is simulated in one sector, with a border through it
// (sectors of 4 m), and by Bullet's own solver and constraints (lpss/simulation/plain_world.h) where it has
// them, at 1/60 s; unless quick, also at 1/240 and 1/1000 s, with 1 and 16 substeps, and by Bullet with 100
// passes.
//
// Table "rows": {engine, group, mechanism, world, time_step, bodies, joints, seconds, whole, gap_um,
// twist_urad, energy_gain, energy_end, momentum_drift, angular_momentum_drift, way_m, error, error_is,
// tick_us, same_bits, hash}. Largest values of a run; what was not measured is null.
//   whole          no joint came apart by a tenth of a metre, nothing diverged
//   energy_gain    rise of the mechanical energy above its start, by the largest kinetic energy, and where it
//   was
//                  at the end: of what nothing drives
//   ..._drift      of what nothing holds, relative
//   way_m          after 1 s, of the body that is farthest from where it is in f64 in steps of 1/7680 s
//   (1/1920 if
//                  quick)
//   error          of what closed forms say (error_is)
//   tick_us        median of processor times of ticks
//   same_bits      with a border through it: whether 1, 2 and 4 partitions have the same hash after each tick
//
// Misses: mechanisms in one sector at 1/60 s with a gap above 1 mm, an energy gain above 1 %, or that break;
// and bits that differ.
absl::StatusOr<Report> measure_joints(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
