// Which bodies touch, and where; between ticks.
#pragma once

#include <span>
#include <vector>

#include "lpss/partition/contact_patch.h"
#include "lpss/partition/partition.h"

namespace tessera {

struct TouchingPatch : ContactPatch {
  BodyId a;  // a < b
  BodyId b;
};

// The patches of all pairs with any of the bodies that this partition detects, ascending by (a, b), those of
// a pair in one order. Each pair of the world is told by one partition. Pairs at rest are as their last tick
// left them; packed sectors that have any come back. `bodies` ascend.
std::vector<TouchingPatch> contacts_of(Partition& partition, std::span<const BodyId> bodies);

}  // namespace tessera
