// The gravity on a body, from exact relative positions.
#pragma once

#include <Eigen/Core>

#include "lpss/model/settings.h"

namespace tessera {

// The acceleration (m/s^2, world axes) of a body at `position` (m, relative to the centre of `home`). For a
// planet, the difference of the sector indices is taken exactly before it becomes a distance, so the result
// is the same wherever in the world the two are.
Eigen::Vector3d acceleration_at(const Gravity& gravity, const SectorIndex& home,
                                const Eigen::Vector3d& position, double sector_size);

}  // namespace tessera
