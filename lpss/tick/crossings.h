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

// What takes islands into other frames at the beginning of the next tick: those of which each body is inside
// the region of one, or outside that of its own, by kRegionHysteresis. Joints and contacts with what a frame
// is made of hold an island in it (see kBoardingSpeed).
void append_crossings(const Partition& partition, Tick tick, ProgramActs& acts);

// The jumps of the islands all of whose bodies are to go to the same frame, ascending by body.
std::vector<Teleport> agreed_jumps(std::vector<Crossing> crossings);

}  // namespace tessera
