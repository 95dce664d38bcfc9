// Worlds of boxes of 1 m, large enough to be worth measuring.
#pragma once

#include "lpss/model/world_description.h"

namespace tessera {

// `count` boxes, dropped in four layers 1.1 m apart, a little out of line.
WorldDescription dropped_boxes(const WorldSettings& settings, int count);

// `count` towers of ten, 3 m apart, slightly out of line.
WorldDescription towers_of_ten(const WorldSettings& settings, int count);

}  // namespace tessera
