// The paper's Fig. 7: the time of a tick by phase, compared with plain Bullet.
#pragma once

#include <span>

#include "experiments/catalogue.h"
#include "lpss/tick/messages.h"

namespace tessera {

// Towers of eight boxes on a floor, a gap of 1 m between them, in sectors of 16 m: at every eighth row and
// column of towers a border goes through their boxes. Nothing sleeps. The same bodies under three settings,
// and in one world of plain Bullet (plain_world.h), are stepped alternately, tick by tick, for 128 to 32,768
// bodies. All have the same number of passes over the rows of an island; with 1 small step, the solver is
// plain Bullet's own.
//
// Times are processor times on one thread, so that other load on the machine does not count.
//
// Table "rows": {engine, seams, substeps, bodies, phase, us, share}. `us` is the median over the ticks,
// `share` that of the whole tick. The phases are those of a tick (lpss/tick/phase_clock.h says what is in
// which), whose shares make up about 1, and "hashing": Simulation::hash() after it, which is no part of a
// tick, but comes on top where it is asked for.
//
// Table "ticks": {engine, seams, substeps, bodies, sectors, clones, contacts, islands_across_seams, ticks,
// tick_us, plain_us, ratio, hash}. `tick_us` is the median of whole ticks, `plain_us` that of plain Bullet's
// steps, `ratio` the one by the other; counts are of the last tick, and so is the hash.
absl::StatusOr<Report> measure_overhead(const ExperimentOptions& options, const Progress& progress);

// The same for other numbers of bodies (multiples of eight), of which `ticks` each are measured.
absl::StatusOr<Report> measure_overhead_of(Precision precision, std::span<const int> bodies, Tick ticks,
                                           const Progress& progress);

}  // namespace tessera
