// What bodies feel in frames that move, tick by tick.
#pragma once

#include "lpss/partition/partition.h"
#include "lpss/tick/messages.h"

namespace tessera {

// What is felt in a tick that is to begin. Wakes what rests in frames in which that has changed by a step of
// kFeltStep since the tick before; true if there is such a frame, which all servers find alike.
bool begin_frames(Partition& partition, Tick tick);

// What was felt in the last of so many completed ticks; for a partition that goes on from there.
void set_felt(Partition& partition, Tick tick);

// The bodies of the sector, which belongs to a frame that moves, feel it in this tick.
void feel(const Partition& partition, Sector& sector, const ParallelFor& parallel);

// Whether bodies may change their frames in this tick.
bool may_cross(const Partition& partition);

// What takes bodies into other frames at the beginning of the next tick: those that have flown freely in this
// one (SectorWorld::flew()) to where the region of a frame begins, or ends.
void append_crossings(const Partition& partition, Tick tick, ProgramActs& acts);

}  // namespace tessera
