// What a body bears that carries a frame: the sums over all bodies aboard, and what they make of its motion.
//
// A carrier is solved as if it had the mass of what is aboard, and about as much inertia (its ballast); by
// how that moves against the frame, it is pushed in the tick after. So a crew that runs moves its ship, cargo
// at the bow pitches it, and a carrier may be lighter than what is aboard: momentum is that of both together,
// but for what one tick still owes the next (docs/architecture.md, Frames that move).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "lpss/partition/partition.h"
#include "lpss/tick/messages.h"

namespace tessera {

// The sums of all bodies of a frame that live here, as they are now.
BurdenSums burden_of(const Partition& partition, FrameNumber frame);

// Frames that dynamic bodies carry, with the sums as the tick begins, once bodies are where they live.
std::vector<FrameBurden> begin_burdens(const Partition& partition);
// Likewise, as it ends.
void end_burdens(const Partition& partition, std::vector<FrameBurden>& burdens);

// Gives those that live here the ballast of the tick that begins: before its commands push them, as it would
// be if they had just come from another server.
void load_carriers(Partition& partition);

// Pushes carriers by what has moved aboard in this tick, of which all servers have told; and sets their
// ballast. `before`: where their frames were as the tick began. Partition::carried has where they are now.
std::vector<Command> bear_burdens(Partition& partition, Tick tick, const std::vector<CarriedFrame>& before,
                                  const std::vector<ProgramActs>& acts);

}  // namespace tessera
