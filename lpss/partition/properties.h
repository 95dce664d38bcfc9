// Properties of bodies that change while the world runs.
#pragma once

#include "lpss/partition/partition.h"

namespace tessera {

// From now on the body has these properties, on every server that knows it: of the same shape, centre frame
// and assembly, and static if it is. What touches it wakes, and its contacts are found anew. A body that is
// dynamic or kinematic from now on keeps its velocity. The child of a joint stays dynamic; joints whose
// parent the body is follow it. Nothing happens where nobody knows the body.
void set_properties(Partition& partition, BodyId id, const BodyProperties& properties);

}  // namespace tessera
