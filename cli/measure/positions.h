// Where bodies are, for runs of a world that are compared.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lpss/model/body.h"

namespace tessera {

// m, of bodies in the order of their ids.
using Positions = std::vector<Eigen::Vector3d>;

// Of all bodies of `records`, in their order: metres from `origin`.
Positions positions_from(const WorldPosition& origin, const std::vector<BodyRecord>& records,
                         double sector_size);

// The largest distance (m) of two bodies in the same place of both; infinite where one is no number.
double largest_distance(const Positions& a, const Positions& b);

}  // namespace tessera
