// Worlds that are measured side by side, in turns, so that what else the machine does meets all of them.
#pragma once

#include <absl/status/status.h>

#include <algorithm>
#include <vector>

#include "cli/measure/report.h"
#include "lpss/tick/messages.h"

namespace tessera {

// That a world is stepped before it is the turn of the next. In turns of one tick, each would find that the
// others have taken the place of its data in the processor's cache.
inline constexpr Tick kTicksInTurn = 25;

// Calls `step` for each world and tick: `in_turn` ticks of one, then as many of the next. CANCELLED where the
// work is to end.
template <typename World, typename Step>
absl::Status in_turns(std::vector<World>& worlds, Tick ticks, Tick in_turn, ProgressCount& count,
                      const Step& step) {
  for (Tick done = 0; done < ticks; done += in_turn) {
    const Tick turn = std::min(in_turn, ticks - done);
    for (World& world : worlds) {
      for (Tick tick = 0; tick < turn; ++tick) step(world);
    }
    for (Tick tick = 0; tick < turn; ++tick) {
      if (absl::Status status = count.advance(); !status.ok()) return status;
    }
  }
  return absl::OkStatus();
}

}  // namespace tessera
