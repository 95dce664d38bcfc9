// Models that a detachable-joint system of Gazebo holds together until it is told not to.
#pragma once

#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera::gazebo {

// Replaces such plugins of the models of a <world> with fixed joints beside the models, and with programs
// that break these when they are told to `release`. `notices` gets what has come of them.
void take_detachable_joints(xml::Element& world, Notices& notices);

}  // namespace tessera::gazebo
