// Seam search: which sectors need a replica of which body.
#pragma once

#include <Eigen/Geometry>

#include "lpss/partition/partition.h"

namespace tessera {

// Whether a body has moved, or something about it changed, since others last heard of it.
bool may_have_moved(const HomeBody& body);

// The sectors, relative to its home, that need a replica of a body whose box sweeps `swept` (m, relative to
// the home's centre).
OffsetSet sectors_to_tell(const Partition& partition, const Eigen::AlignedBox3d& swept, Motion motion);

// Attends to the bodies that may have moved and come near a border; the others are inside, and need nobody.
void attend_borders(Partition& partition);

// Finds them for every attended body that may have moved.
void search_seams(Partition& partition);

}  // namespace tessera
