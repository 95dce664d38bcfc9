// Worlds in MuJoCo, where the build has found it (Debian's libmujoco-dev): for comparison only.
#pragma once

#include <absl/status/statusor.h>

#include <memory>

#include "cli/measure/local_world.h"

namespace tessera::truth {

bool has_mujoco();

// Bodies, fixed, revolute, prismatic and ball joints, springs and drives of the world, in MuJoCo's own
// coordinates, with its defaults, but for an elliptic cone of friction. Of commands, it takes drives. It
// knows no restitution. UNIMPLEMENTED for what it has no words for, or without MuJoCo; INTERNAL where it
// refuses a world.
absl::StatusOr<std::unique_ptr<LocalWorld>> in_mujoco(const WorldDescription& world);

}  // namespace tessera::truth
