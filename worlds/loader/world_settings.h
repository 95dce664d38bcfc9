// The settings of a world in an SDF file.
#pragma once

#include <absl/status/status.h>

#include "lpss/model/world_description.h"
#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera {

// Those of a <world>: its gravity, its default <physics>, and its tessera: elements. INVALID_ARGUMENT with
// file, line and element.
absl::Status read_world_settings(const xml::Element& world, WorldSettings& settings, Notices& notices);

}  // namespace tessera
