// Places on the globe (WGS84) as frames of an Earth-centred world.
#pragma once

#include <absl/status/statusor.h>

#include "lpss/grid/world_position.h"

namespace tessera {

// The meaning of "up" at a site: normal to the ellipsoid, as on a map, or away from the Earth's centre,
// opposite to central gravity. The two differ by up to 0.19 degrees.
enum class SiteUp { kGeodetic, kGeocentric };

// A frame at `latitude` and `longitude` (degrees) and `height` (m above the ellipsoid) in a world whose
// origin is the Earth's centre, z towards the north pole and x through longitude 0: x points east, y north, z
// up. Computed in double precision, accurate to 1e-9 m, and directly converted to a sector. INVALID_ARGUMENT
// for a latitude outside [-90, 90], a longitude outside [-360, 360] or a height outside [-1e6, 1e8] m.
absl::StatusOr<WorldPose> site_frame(double latitude, double longitude, double height, SiteUp up,
                                     double sector_size);

}  // namespace tessera
