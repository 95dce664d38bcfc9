// Scenes whose motion mechanics gives in closed form, beside what other engines make of them.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// Each scene (truth/scene.h) runs in Tessera, in sectors of the default size and with a border through it,
// and in plain Bullet where that has all of it, in a process of its own, so that a crash also becomes a row.
// Where MuJoCo was found by the build, worlds that it has words for run there, too, with the double engine.
//
// Table "rows": {group, scene, engine, sector_m, quantity, unit, right, got, bound, ok, order, message}.
//   engine     f32, f64, "Bullet f32", "Bullet f64", "MuJoCo"
//   sector_m   of Tessera alone
//   got        null where it is no number, or the scene did not run: `message` says why
//   bound      |got - right| <= bound is asked for
//   order      log2 of how much smaller the error is with half the time step, where the scene has it and the
//              errors are above rounding
// Table "summary": {group, engine, quantities, ok}: how many of a group are within their bounds.
//
// Misses: rows of Tessera that are not `ok`.
absl::StatusOr<Report> measure_truth(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
