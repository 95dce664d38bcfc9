// A station in orbit for a day.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// Two hulls, each of which carries a frame, fall around a planet at 400 km: a station of 20 t with a crew of
// three and a ball that floats, and a ship of 8 t with a pilot and cargo. For ten minutes, nobody moves and
// the ship approaches. Then a fixed joint docks it, and everyone aboard pushes off from the hull again and
// again until a day is over (quick: 20 minutes). In double precision alone; in single precision, the report
// is empty.
//
// The reference is integrated beside it by the method of Runge and Kutta in steps of a second: the common
// centre of mass, which the pull at the place of every body accelerates; the angular momentum about it, which
// that pull changes; and for the first ten minutes the path of the ball as seen from the station.
//
// Table "day": {hours, place, momentum, spin, gap, turn}: every hour (quick: every minute), the largest
// errors so far: of the common centre of mass (m), of the momentum of all (as a part of it), and of the
// angular momentum about the centre of mass (kg m^2/s); and the largest distance (m) and angle (rad) by which
// the joint has come apart.
//
// Table "docking": {ticks, tick_us, docked, speed, spin, pushes}: the mean processor time of a tick; when the
// ship docked (s), and how fast it came (m/s); the largest angular momentum about the centre of mass
// (kg m^2/s) after; and how often somebody pushed off.
//
// Table "kept": {quantity, unit, got, bound, ok}: the errors at the end, and what they may be.
absl::StatusOr<Report> measure_day(const ExperimentOptions& options);

}  // namespace tessera
