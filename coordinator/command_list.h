// Lists of clients' commands, as servers carry them out.
#pragma once

#include <absl/status/statusor.h>
#include <google/protobuf/repeated_ptr_field.h>

#include <cstddef>
#include <limits>
#include <string>

#include "command.pb.h"
#include "coordinator/sequencer.h"
#include "coordinator/world_registry.h"
#include "recording.pb.h"

namespace tessera {

struct GivenCommands : SequencedCommands {
  v1::Applied applied;
};

// Carries out a list, which takes effect at tick `at`, on the registry; the caller keeps that, or rolls it
// back. Errors name the element, and leave the registry to be rolled back: NOT_FOUND for a body or joint that
// does not exist, INVALID_ARGUMENT for a value that is out of bounds or does not suit the kind of body,
// ALREADY_EXISTS for a name in use, OUT_OF_RANGE for a position outside the 64-bit range of sectors,
// RESOURCE_EXHAUSTED where the world would have more than it may, FAILED_PRECONDITION for a teleport of a
// body that joints hold; where there is an `owner`, PERMISSION_DENIED for what is not the owner's.
absl::StatusOr<GivenCommands> give(const google::protobuf::RepeatedPtrField<v1::Command>& list,
                                   WorldRegistry& registry, Tick at, const std::string& owner = {},
                                   std::size_t shape_bytes_max = std::numeric_limits<std::size_t>::max());

// What is recorded of the list that comes next, but for its commands.
v1::RecordedCommands next_record(const WorldRegistry& registry, Tick at);

// A list of a recording, or of a store, in a world that has it from now on. Errors as those of give();
// INTERNAL where the ids that come next are others than in the recording.
absl::StatusOr<GivenCommands> give_again(const v1::RecordedCommands& recorded, WorldRegistry& registry);

}  // namespace tessera
