// A pile in a bin.
#pragma once

#include "lpss/model/world_description.h"

namespace tessera::seams {

// `count` boxes, balls, cylinders and capsules of about 1 m above a bin of 16 m around the anchor's centre.
WorldDescription bin_world(const WorldSettings& settings, int count);

}  // namespace tessera::seams
