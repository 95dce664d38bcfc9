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

}  // namespace tessera
