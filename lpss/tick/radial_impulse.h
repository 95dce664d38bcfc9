// Impulses on all bodies around a place.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lpss/tick/landings.h"

namespace tessera {

// A body that lives here, and what it gets.
struct RadialPush {
  HomeBody* body = nullptr;
  Eigen::Vector3d impulse;  // N s, world axes
};

// In any order, since each is of one body. Packed sectors with such bodies come back.
std::vector<RadialPush> pushes_of(Partition& partition, const ApplyRadialImpulse& command,
                                  const Landings& landings);

}  // namespace tessera
