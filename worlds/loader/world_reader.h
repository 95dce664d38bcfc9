// Walks an SDF world: settings first, then everything that has a place, then bodies.
#pragma once

#include <absl/status/statusor.h>

#include "lpss/model/world_description.h"
#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera {

// The world in `file`, which is changed on the way. `notices` says what was left out. Not validated yet.
absl::StatusOr<WorldDescription> read_world(xml::File& file, Notices& notices);

}  // namespace tessera
