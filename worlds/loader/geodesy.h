// Places on the globe (WGS84) as frames of an Earth-centred world.
#pragma once

#include <absl/status/statusor.h>

#include "lpss/grid/world_position.h"

namespace tessera {

// What "up" means at a site: away from the ellipsoid, as a map has it, or away from the Earth's centre, which
// is where central gravity pulls to. The two are up to 0.19 degrees apart.
enum class SiteUp { kGeodetic, kGeocentric };

// A frame at `latitude` and `longitude` (degrees) and `height` (m above the ellipsoid) in a world whose
// origin is the Earth's centre, z towards the north pole and x through longitude 0: x points east, y north, z
// up. Computed in double precision, good to 1e-9 m, and at once put into a sector. INVALID_ARGUMENT for a
// latitude outside [-90, 90], a longitude outside [-360, 360] or a height outside
// [-1e6, 1e8] m.
absl::StatusOr<WorldPose> site_frame(double latitude, double longitude, double height, SiteUp up,
                                     double sector_size);

}  // namespace tessera
