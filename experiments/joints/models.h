// What world files of others do: which load, hold together and come to rest.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// All SDF, URDF and MJCF files (.sdf, .world, .urdf, .xml) below the folder of worlds, each in a process of
// its own, so that a crash or an endless loop also becomes a row: 10 s in one partition, 2 s if quick, or as
// far as 20 s of processor time lead. The same in two partitions, in turns. Models that a file includes are
// searched as `tessera run` does. A robot (joints, and nothing that is static or held by the world) is then
// set on a plane, held by servos for 5 s, and driven (on_plane.h).
//
// Table "rows": {engine, file, outcome, message, bodies, joints, repairs, notices, seconds, start_gap_mm,
// gap_mm, diverged, first, awake, speed_m_s, kinetic_j, energy_gain_j, same_bits, tick_us, hash, lowest_mm,
// wheels, wheel_way}.
//   outcome      loads, repaired, refused, crashed
//   message      of the refusal or crash
//   repairs, notices   kinds of them, as lines
//   start_gap_mm, gap_mm   the largest of a joint: as the file has it, and while it runs
//   diverged     times that a body was stopped; first: what the first one did
//   awake, speed_m_s   at the end: bodies that are awake, and the speed of the fastest
//   kinetic_j    the largest energy of motion
//   energy_gain_j  largest rise of the energy of motion and weight above its start, where nothing is driven,
//                sprung or kinematic; overlaps that open at the start add to it
//   tick_us      median of times of ticks, in one partition
//   lowest_mm    of a robot on a plane: its lowest point after 5 s, above the plane
//   wheels, wheel_way   wheels that are driven, and the way that they cover by their radius times their angle
// Table "outcomes": {engine, folder, files, loads, repaired, refused, crashed, diverged, apart, other_bits,
// sunk, slipped}.
//
// Misses: crashes, files with joints that open by more than 1 mm, that diverge, or end with other bits;
// robots that sink by more than 2 mm, or whose wheels do not cover their way within 1 %.
absl::StatusOr<Report> measure_models(const ExperimentOptions& options, const Progress& progress);

}  // namespace tessera
