// Sectors of a partition: made when something enters, gone when the last thing has left.
#pragma once

#include <utility>
#include <vector>

#include "lpss/partition/partition.h"

namespace tessera {

// The sector, brought back if it is packed, made if there is none yet.
Sector& sector_at(Partition& partition, const SectorIndex& index);

// Its engine world, made with the statics around if there is none yet.
SectorWorld& world_of(Partition& partition, Sector& sector);

// Makes it for a sector that has none, with the statics within `region` (m, relative to the sector's centre).
void make_world(Partition& partition, Sector& sector, const Eigen::AlignedBox3d& region);

// Puts the sector on the list of those that the next tick looks at.
void activate(Partition& partition, Sector& sector);

// Wakes what lives in the sector and touches the body in `slot`: it rests on something that goes away.
void wake_touching(Partition& partition, Sector& sector, BodySlot slot);

// Whether a body that lives in the sector, or a clone in its engine world, is awake.
bool anything_awake(const Sector& sector);

// Forgets the components of the last detection.
void clear_components(Sector& sector);

// What sectors leave behind when they lose their last body.
struct Vacated {
  std::vector<SectorIndex> sectors;                       // of which others know island parts
  std::vector<std::pair<BodyId, BodyId>> ended_contacts;  // which had begun there
  std::vector<Overlap> ended_overlaps;                    // of triggers, likewise
};

// An engine world lives only while a body that can move does, a sector only while something is in it. Whether
// the sector is gone: the caller takes it off the list of active ones.
bool drop_if_empty(Partition& partition, Sector& sector, Vacated& vacated);

}  // namespace tessera
