// Commands of a recording, or of a store, as they take effect.
#pragma once

#include <absl/status/statusor.h>

#include <optional>

#include "coordinator/world_registry.h"
#include "lpss/tick/messages.h"
#include "recording.pb.h"

namespace tessera {

struct GivenCommand {
  Command command;
  std::optional<v1::NumberedShape> new_shape;  // added before the command
};

// What a client's request means in this world, which has it from now on. Errors as those of the request;
// INTERNAL where the id of what it creates differs from that of the recording; DATA_LOSS for no known
// request.
absl::StatusOr<GivenCommand> given_again(const v1::RecordedCommand& recorded, WorldRegistry& registry);

}  // namespace tessera
