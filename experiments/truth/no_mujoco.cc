#include <absl/status/status.h>

#include "experiments/truth/mujoco.h"

namespace tessera::truth {

bool has_mujoco() { return false; }

absl::StatusOr<std::unique_ptr<LocalWorld>> in_mujoco(const WorldDescription&) {
  return absl::UnimplementedError("this build has no MuJoCo");
}

}  // namespace tessera::truth
