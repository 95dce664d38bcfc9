// Worlds that are large enough to be worth measuring.
#pragma once

#include "lpss/model/world_description.h"

namespace tessera {

// `count` boxes of 1 m, dropped in four layers 1.1 m apart, a little out of line.
WorldDescription dropped_boxes(const WorldSettings& settings, int count);

// `count` towers of ten boxes of 1 m, 3 m apart, slightly out of line.
WorldDescription towers_of_ten(const WorldSettings& settings, int count);

// `count` hulls, capsules, boxes, balls, and capsules that hang on each other by ball joints, three in a row,
// dropped onto hilly ground of triangles.
WorldDescription mixed_bodies(const WorldSettings& settings, int count);

// What is poured into a bin.
enum class Poured { kBalls, kCapsules, kBoxes, kCylinders, kAll };

// What they fall on: a box, hills of 28,800 triangles of 2 m, or of 100,352 of 0.27 m.
enum class Bottom { kFloor, kHills, kMesh };

// `count` bodies some 1 m long, of one kind or of all, hulls among them, turned at random, poured into a bin
// of four walls that holds them half a dozen deep.
WorldDescription poured_bodies(const WorldSettings& settings, Poured kind, int count,
                               Bottom bottom = Bottom::kFloor);

}  // namespace tessera
