// Sensors of SDF as programs: docs/gazebo.md says which, and what is different.
#pragma once

#include "worlds/gazebo/model_parts.h"
#include "worlds/loader/notices.h"

namespace tessera::gazebo {

// Gives links of a model programs for the sensors of its links and joints, which are removed. `notices` gets
// what measures, and what is left out, and why.
void take_sensors(const ModelParts& parts, Notices& notices);

}  // namespace tessera::gazebo
