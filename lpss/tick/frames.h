// What bodies feel in frames that move, tick by tick.
#pragma once

#include "lpss/partition/partition.h"
#include "lpss/tick/messages.h"
#include "lpss/tick/parallel.h"

namespace tessera {

// What is felt in a tick that is to begin. Wakes what rests in frames in which that has changed by a step of
// kFeltStep since the tick before; true if there is such a frame, which all servers find alike.
bool begin_frames(Partition& partition, Tick tick);

// How the bodies that live here and carry frames have moved in this tick, where that is news.
void append_carried(const Partition& partition, ProgramActs& acts);

// Frames with carriers are from now on where others say.
void take_carried(Partition& partition, const std::vector<ProgramActs>& acts);

// The carrier goes away: its frames stand still.
void halt_carried(Partition& partition, BodyId carrier);

// What was felt in the last of so many completed ticks; for a partition that goes on from there.
void set_felt(Partition& partition, Tick tick);

// Gives the bodies of a sector what they feel in this tick: gravity, and what the motion of their frame adds.
void feel(const Partition& partition, Sector& sector, const ParallelFor& parallel);

}  // namespace tessera
