// Worlds in MuJoCo, where the build has found it (Debian's libmujoco-dev): for comparison only.
#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <vector>

#include "cli/measure/local_world.h"
#include "experiments/mujoco/mjcf.h"

namespace tessera {

bool has_mujoco();

// In MuJoCo's own coordinates, as mjcf_of() has it. Of commands, it takes drives: efforts, and targets of
// servos that were servos at the start. Errors: those of mjcf_of(); UNIMPLEMENTED without MuJoCo; INTERNAL
// where it refuses a world.
absl::StatusOr<std::unique_ptr<LocalWorld>> in_mujoco(const WorldDescription& world);

// `count` worlds that are alike, and share what never changes: how its users have many robots.
absl::StatusOr<std::vector<std::unique_ptr<LocalWorld>>> alike_in_mujoco(const WorldDescription& world,
                                                                         const MujocoOptions& options,
                                                                         int count);

}  // namespace tessera
