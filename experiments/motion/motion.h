// What it costs to be on something that moves, and whether what happens there is right.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// Scenes in a frame at up to 3e7 m/s; one thread.
//
// Table "rows": {engine, scene, speed, ticks, tick_us, ratio, hash, same}: the median of the processor time
// of a tick, its ratio to that of the same scene in a frame at rest, with which it is stepped in turns, and
// whether its hash is the same at every tick, in one partition and in two and four.
//
// Table "asleep": {engine, where, bodies, tick_us, ratio}: 500 crates that sleep on the ground, and in a ship
// at 7.8 km/s, each beside one ball that rolls in the same sector.
//
// Table "brakes": {engine, braking, friction, boxes, woken, slid, right, error}: a train at 30 m/s with 1,000
// boxes (quick: 100) that sleep, which brakes for 2 s: how many wake in its first tick, and how far boxes
// slide (m, mean) beside what friction and braking make of it.
//
// Table "crossings": see crossings.h. Tables "day", "docking" and "kept": see day.h.
//
// Groups and names for ExperimentOptions::only, and the error where it chooses none: `speeds` with the names
// of scenes, `sleep crates`, `brakes 4 m/s^2`, `crossings 30 m/s`, `orbit day`.
absl::StatusOr<Report> measure_motion(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
