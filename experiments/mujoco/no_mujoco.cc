#include <absl/status/status.h>

#include "experiments/mujoco/mujoco.h"

namespace tessera {

bool has_mujoco() { return false; }

absl::StatusOr<std::unique_ptr<LocalWorld>> in_mujoco(const WorldDescription&) {
  return absl::UnimplementedError("this build has no MuJoCo");
}

absl::StatusOr<std::vector<std::unique_ptr<LocalWorld>>> alike_in_mujoco(const WorldDescription&,
                                                                         const MujocoOptions&, int) {
  return absl::UnimplementedError("this build has no MuJoCo");
}

}  // namespace tessera
