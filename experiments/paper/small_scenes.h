// The scenes of the paper's figures, around the centre of the anchor's sector.
#pragma once

#include <absl/status/status.h>

#include "lpss/grid/world_position.h"
#include "lpss/model/world_description.h"

namespace tessera {

// Two balls of 0.5 m radius that fly at each other at 5 m/s each and graze. They meet between two ticks: a
// pair that meets exactly on one is decided by the last digit of its place (by 0.157 m, where that was
// measured).
WorldDescription collision_scene(const WorldSettings& settings);

// Moves all bodies, and all joints to the world, such that what is at the centre of sector (0, 0, 0) comes to
// `place`, whose local part may be beyond its sector. The anchor stays. Errors as canonical().
absl::Status move_to(WorldDescription& world, const WorldPosition& place);

}  // namespace tessera
