// What drives and springs may do in this tick to the bodies that live here, so that contacts are found before
// they are touched (SectorWorld::surge()).
//
// Of a joint, its child is looked at: the record of the joint is where that lives, wherever its parent is.
// Where the parent is static or the world, the axis is known, and so is how far it is off its target.
// Elsewhere a bound takes its place: at any time for an effort, as that does not depend on the axis; of other
// drives and of springs only in the tick in which a drive is set, or in which the child does not move at all.
// At other times, what these add in a tick is little beside the way that velocities foresee.
#pragma once

#include "lpss/partition/partition.h"

namespace tessera {

// After the commands of the tick, before anybody looks at borders.
void foresee_drives(Partition& partition);

}  // namespace tessera
