// Which elements of SDF are simulated.
#pragma once

#include <absl/strings/string_view.h>

namespace tessera {

// Whether an element of SDF has nothing to do with the motion of bodies here: visuals, sensors, plugins.
bool is_no_physics(absl::string_view name);
// What becomes of such an element, as a notice says it.
absl::string_view fate_of(absl::string_view name);

// Whether an element of SDF with a value is simulated where it is in one of the name `parent`.
bool is_simulated(absl::string_view parent, absl::string_view name);

}  // namespace tessera
