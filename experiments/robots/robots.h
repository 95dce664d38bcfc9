// What robots cost and keep: ants and humanoids with servos on a plane, beside MuJoCo in the same run.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// 256 ants of 8 hinges and 64 humanoids of 21 (quick: 16 and 4), whose servos follow targets that swing, on a
// plane, at 1/60 s, never asleep; one thread. Stepped in turns: all of them in sectors of 16 m, and in one
// sector; and in MuJoCo, each in an environment of its own, in one step a tick and in four by its defaults
// (Euler, implicit in the damping of joints; a pyramid of friction), and in one by its implicit integrator.
// Both have the same masses, inertias, axes, limits, gains and friction.
//
// Table "rows": {engine, robot, world, robots, hinges, ticks, steps_per_s, ratio, gap_mm_max, gap_mm_mean,
// below_mm_max, below_mm_mean, height_m, thrown, thrown_lost, energy_error_max, energy_error_mean,
// spin_error_max, spin_error_mean, hash}.
//   steps_per_s    ticks of a robot in a second of processor time; `ratio` to MuJoCo in one step a tick
//   gap_mm         distances of the two points of a joint. MuJoCo's coordinates leave none
//   below_mm       of the lowest point below the plane
//   height_m       of trunks: whether all do about the same. These three are taken over all robots and every
//                  fifth tick
//   thrown         robots with free hinges that were thrown, without gravity, for 5 s (quick: 1)
//   thrown_lost    of these, how many more than doubled their energy, or diverged
//   energy_error, spin_error
//                  of the others: the largest change of energy and angular momentum, relative
//
// Misses: a build without MuJoCo; what diverged on the plane.
absl::StatusOr<Report> measure_robots(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
