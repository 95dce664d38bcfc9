// Masses of SDF links as libsdformat needs them.
#pragma once

#include <absl/status/status.h>

#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera {

// Mends the numbers of an <inertial> that no body has, or that no engine can divide by (repair()).
// INVALID_ARGUMENT for masses below 0 and for what is no number.
absl::Status repair_inertial(xml::Element& inertial, Notices& notices);

// Gives links with a mass of 0 that of give_least_masses(), in a model that is not static. Errors likewise.
absl::Status repair_massless_links(xml::Element& model, Notices& notices);

}  // namespace tessera
