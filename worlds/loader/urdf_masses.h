// Masses of URDF links as libsdformat needs them.
#pragma once

#include <absl/status/status.h>

#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera {

// Libsdformat joins links that fixed joints connect, and drops what has no mass then, with all its children.
// Here such links get one: at the root, which is fixed to the world as in Bullet, any; elsewhere that of
// give_least_masses(). Numbers that are missing are 0. INVALID_ARGUMENT for masses below 0 and for what is no
// number.
absl::Status repair_urdf_masses(xml::Element& robot, Notices& notices);

}  // namespace tessera
