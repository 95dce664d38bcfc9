// The paper's Fig. 7: the time of a tick by phase, compared with plain Bullet.
#pragma once

#include <span>

#include "experiments/catalogue.h"
#include "lpss/tick/messages.h"

namespace tessera {

// Towers of eight boxes on a floor, 1 m apart, in sectors of 16 m: a border goes through the boxes of every
// eighth row and column of towers. Nothing sleeps. The same bodies with three settings, and in one plain
// Bullet world (plain_world.h), are stepped alternately, tick by tick, for 128 to 32,768 bodies. All make the
// same number of passes over the rows of an island; the policy clone has Bullet's own solver.
//
// Times are processor times on one thread, independent of other load on the machine.
//
// Table "rows": {engine, seams, substeps, bodies, phase, us, share}. `us` is the median over the ticks,
// `share` the share of the whole tick. The phases are those of lpss/tick/phase_clock.h, with shares that add
// up to about 1, and "hashing": Simulation::hash() after the tick, which is optional and not part of it.
//
// Table "ticks": {engine, seams, substeps, bodies, sectors, clones, contacts, islands_across_seams, ticks,
// tick_us, plain_us, ratio, hash}. `tick_us` is the median of whole ticks, `plain_us` that of plain Bullet's
// steps, `ratio` the quotient; counts and hash are those of the last tick.
absl::StatusOr<Report> measure_overhead(const ExperimentOptions& options, const Progress& progress);

// The same for given numbers of bodies (multiples of eight), measuring `ticks` ticks each.
absl::StatusOr<Report> measure_overhead_of(Precision precision, std::span<const int> bodies, Tick ticks,
                                           const Progress& progress);

}  // namespace tessera
