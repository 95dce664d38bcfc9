// The scenes of the paper's figures, around the centre of the anchor's sector.
#pragma once

#include <absl/status/status.h>

#include "lpss/grid/world_position.h"
#include "lpss/model/world_description.h"

namespace tessera {

// Two balls of 0.5 m radius that approach each other at 5 m/s each and graze. They meet between two ticks:
// for a pair that meets exactly on a tick, the last digit of its position decides the result (0.157 m,
// measured).
WorldDescription collision_scene(const WorldSettings& settings);

// Moves all bodies, and all joints to the world, such that the centre of sector (0, 0, 0) moves to `place`,
// whose local part may be outside its sector. The anchor stays. Errors as canonical().
absl::Status move_to(WorldDescription& world, const WorldPosition& place);

}  // namespace tessera
