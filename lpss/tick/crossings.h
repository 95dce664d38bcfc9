// Who changes frames: islands that have come into the region of a frame that moves, or have left it.
#pragma once

#include <vector>

#include "lpss/partition/partition.h"
#include "lpss/tick/messages.h"

namespace tessera {

// What stands on something, or is held by contact with it, is not swept away by a region that passes: it goes
// over to a frame in which it is faster than before by at most this, m/s.
inline constexpr double kBoardingSpeed = 3;

// Whether bodies may change their frames in this tick.
bool may_cross(const Partition& partition);

// Islands all of whose bodies that live here are inside the region of a frame, or outside that of their own,
// by kRegionHysteresis. Joints and contacts with what a frame is made of hold an island in it (see
// kBoardingSpeed). Bodies that carry frames stay in the world's.
void append_crossings(const Partition& partition, Tick tick, ProgramActs& acts);

// Where the bodies of those islands that cross whole are at the beginning of the next tick, ascending by
// body. After take_carried().
std::vector<Teleport> agreed_jumps(const Partition& partition, Tick tick, std::vector<Crossing> crossings);

}  // namespace tessera
