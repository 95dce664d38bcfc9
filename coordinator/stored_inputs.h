// What has happened to a world since its stored state, given again to a coordinator that begins with that.
#pragma once

#include <absl/status/status.h>

#include <functional>
#include <vector>

#include "coordinator/active_world.h"
#include "coordinator/sessions.h"
#include "coordinator/world_store.h"
#include "tessera.pb.h"

namespace tessera {

struct GivenInputs {
  v1::StoredPace pace;                             // the last one
  std::vector<v1::LeftOut> left_out;               // lists that were not given
  std::vector<const v1::RecordedCommands*> given;  // of `stored`
};

// Gives `world`, which is in the stored state at `tick`, the inputs since; `sessions` remember what was
// answered. Lists of ticks that are to be left out are not given, nor are those that cannot be without them.
// DATA_LOSS for any other that cannot be given.
absl::StatusOr<GivenInputs> give_inputs(const StoredWorld& stored, Tick tick, ActiveWorld& world,
                                        Sessions& sessions);

}  // namespace tessera
