// What ground costs that is made tile by tile.
#pragma once

#include "experiments/catalogue.h"

namespace tessera {

// A planet of the Earth's size with ground everywhere: hills and a sea, a vertex every 16 m. On it, boxes
// that are dropped at random places (1,000; quick: 100), a car that drives off at a coast, a ball without
// friction that is thrown along the ground at 250 m/s, and a body without gravity that passes over it at 250
// m/s. One minute (quick: 10 s), in one process, in four partitions of one process, and on one server and on
// four.
//
// Table "rows": {engine, where, ticks, boxes, tick_ms, ticks_waited, tiles, tile_mb, process_mb, same_bits,
// hash}: `ticks_waited` are those after the first second in which a tile was not there in time, `process_mb`
// the peak memory of the largest server or of the process. Table "memory", of one process: {engine, second,
// awake, sectors, heap_mb, tiles, tile_mb}. Table "ways", of one process: {engine, body, way_km, height_from,
// height_to}: over the ground, m.
absl::StatusOr<Report> measure_ground(const ExperimentOptions& options, const Progress& progress);

// The world, with so many boxes. Errors: those of worlds.
absl::StatusOr<WorldDescription> globe_world(const WorldSettings& settings, int boxes);

}  // namespace tessera
