// Commands: what clients asked for takes effect at the beginning of a tick.
#pragma once

#include <span>
#include <vector>

#include "lpss/partition/partition.h"
#include "lpss/tick/divergences.h"
#include "lpss/tick/homes.h"
#include "lpss/tick/messages.h"

namespace tessera {

// Every server sees every command: the one that hosts the body carries it out, and those that know it as a
// replica forget what no longer holds. Returns the bodies that are elsewhere from now on, for change_homes().
// Appends those that a command would have taken out of all range, and that stay where they are; and to the
// outbox the contacts of bodies that change frames together.
std::vector<HomeChange> apply_commands(Partition& partition, std::span<const Command> commands,
                                       std::vector<Exchange>& outbox, std::vector<Stopped>& stopped);

}  // namespace tessera
