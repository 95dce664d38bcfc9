// Which sectors at rest are packed, when, and what brings them back: whatever asks for them.
//
// A packed sector comes back with the bits that it had, so that nothing depends on whether it was packed.
#pragma once

#include "lpss/partition/partition.h"

namespace tessera {

// Of the sectors that have been at rest for long enough, so many are packed in a tick, or this share of them
// where that is more.
inline constexpr std::size_t kPackedAtOnce = 64;
inline constexpr std::size_t kPackedShare = 64;

// Has the sector packed once it has been at rest for long enough. At the end of every stretch of activity.
void note_rest(Partition& partition, Sector& sector);

// Ends a tick.
void pack_resting(Partition& partition);

// Brings a sector back, as it was: at rest. Its components are found anew (components_stale). Nothing happens
// where it is not packed.
void bring_back(Partition& partition, const SectorIndex& index);

// All sectors in which the body lives, or a clone of it is.
void bring_back_holding(Partition& partition, BodyId id);

// All sectors in which something rests on a static body: packed ones take their statics as they are by the
// time they come back, so only these are concerned by it.
void bring_back_touching(Partition& partition, BodyId id);

// All sectors with a body that may have to be told to others, by margins that have grown.
void bring_back_near_borders(Partition& partition);

}  // namespace tessera
