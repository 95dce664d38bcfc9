// Patches in which two bodies touch, as the last tick left them.
#pragma once

#include <array>
#include <vector>

#include "lpss/grid/world_position.h"
#include "lpss/partition/partition.h"

namespace tessera {

// Points that share a normal. Impulses are those of the last solution.
struct ContactPatch {
  // The deepest point, on b; of those that are as deep to 0.1 mm, always the same one.
  WorldPosition position;
  std::array<double, 3> normal{};     // on b, pointing to a
  double impulse = 0;                 // N s, on a along the normal, of all points
  std::array<double, 3> friction{};   // N s, on a, in the world's axes
  double depth = 0;                   // m, > 0 where the bodies overlap
  std::vector<TouchingPoint> points;  // relative to `position`
};

// `detail` is what the engine has of it in the sector.
ContactPatch patch_of(const Partition& partition, const Sector& sector, ContactDetail detail);

}  // namespace tessera
