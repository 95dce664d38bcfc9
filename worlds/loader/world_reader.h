// Reads a world. Of SDF: settings first, then everything with a pose, then bodies.
#pragma once

#include <absl/status/statusor.h>

#include "lpss/model/world_description.h"
#include "worlds/loader/look.h"
#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera {

// The world in `file`, which is modified. `notices` gets what was left out. Not validated yet. With `looks`,
// what bodies look like, by name: their shapes are then no collisions.
absl::StatusOr<WorldDescription> read_world(xml::File& file, Notices& notices, Looks* looks = nullptr);

}  // namespace tessera
