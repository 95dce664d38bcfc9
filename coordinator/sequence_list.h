// A list of commands on its way, once the registry has carried it out.
#pragma once

#include "coordinator/active_world.h"
#include "coordinator/command_list.h"
#include "coordinator/context.h"

namespace tessera {

// Servers get it in the sequence, and the recording and the store have it; the session of the request, if it
// has one, will know it again.
void sequence_list(const CoordinatorContext& context, ActiveWorld& world, GivenCommands given,
                   v1::RecordedCommands recorded, RequestId request);

}  // namespace tessera
