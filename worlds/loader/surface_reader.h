// The surface of a link: friction, bouncing, and how it moves.
#pragma once

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <sdf/Link.hh>

#include "lpss/model/body.h"
#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera {

// In a <link>, how libsdformat passes on what it says, in numbers.
inline constexpr absl::string_view kSurfaceMotion = "tessera:surface_motion";

// Checks <tessera:surface_motion velocity="x y z" running="x y z"/> of a <link>, and keeps it as numbers.
absl::Status keep_surface_motion(xml::Element& link);

// A body has one surface: that of its first collision, and all bits of its collisions.
void read_surface(const sdf::Link& link, BodyProperties& properties, Notices& notices);

}  // namespace tessera
