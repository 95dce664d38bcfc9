// URDF robots as SDF models.
#pragma once

#include <absl/status/statusor.h>

#include <memory>

#include "worlds/loader/notices.h"
#include "worlds/loader/visuals.h"
#include "worlds/loader/xml.h"

namespace tessera {

// The <robot> of `file` as a document <sdf><model>. Links that fixed joints connect become one, as in
// libsdformat. Three conventions of robots written for Bullet are supported: a root link of mass 0 is
// fixed to the world, a joint of type `spherical` is a ball joint, and there are capsules.
// INVALID_ARGUMENT for other links without mass, and for errors of libsdformat.
absl::StatusOr<std::unique_ptr<xml::File>> urdf_to_sdf(xml::File& file, ShapeSource shapes, Notices& notices);

}  // namespace tessera
