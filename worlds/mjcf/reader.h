// Reads worlds and robots of MuJoCo.
#pragma once

#include <absl/status/statusor.h>

#include "lpss/model/world_description.h"
#include "worlds/loader/look.h"
#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera::mjcf {

// The world in `file`, whose root is <mujoco>, and which is modified. What moves is one model, and so is what
// does not. A keyframe named "home", or else the first one, says where all is at the start. `notices` gets
// what was left out. Not validated yet. With `looks`, what bodies look like, by name. FAILED_PRECONDITION
// without MuJoCo, with the package that has it; other errors as those of load_world_file().
absl::StatusOr<WorldDescription> read_mjcf(xml::File& file, Notices& notices, Looks* looks = nullptr);

}  // namespace tessera::mjcf
