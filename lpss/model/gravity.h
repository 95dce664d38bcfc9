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

// The same of a body at `from_centre` (m, world axes) from the centre of a planet, if there is one.
Eigen::Vector3d acceleration_from(const Gravity& gravity, const Eigen::Vector3d& from_centre);

// By how much the acceleration `beyond` (m) from there differs, without a difference of nearly equal numbers
// (Battin, section 8.4: Encke's method).
Eigen::Vector3d difference_from(const Gravity& gravity, const Eigen::Vector3d& from_centre,
                                const Eigen::Vector3d& beyond);

// The mean acceleration (m/s^2, world axes) over the last `dt` s of a body in free flight that is now at
// `from_centre` (m) with `velocity` (m/s): half of it is the pull where it was, and half that where it is.
Eigen::Vector3d mean_pull(const CentralGravity& planet, const Eigen::Vector3d& from_centre,
                          const Eigen::Vector3d& velocity, double dt);

// How the acceleration changes with the place (1/s^2, world axes): difference_from() to first order.
Eigen::Matrix3d gradient_at(const CentralGravity& planet, const Eigen::Vector3d& from_centre);

}  // namespace tessera
