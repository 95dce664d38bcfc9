// What is said of a compiled model beyond what is simulated.
#pragma once

#include "worlds/loader/notices.h"
#include "worlds/mjcf/model.h"

namespace tessera::mjcf {

void note_unread(const mjModel& model, Notices& notices);

// Of a free joint.
void note_free_joint(const mjModel& model, int joint, Notices& notices);

}  // namespace tessera::mjcf
