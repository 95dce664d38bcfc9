// States of a world as files of a store.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <filesystem>
#include <string>

#include "coordinator/state_parts.h"
#include "coordinator/world_store.h"
#include "proto/disk.h"

namespace tessera {

// As WholeFile, with errors of SnapshotEncoder.
absl::Status write_state(const std::filesystem::path& file, const StoredState& state, Disk& disk);

// The state that the file `name` and those before it are. Errors as read_snapshot(), which
// checks each byte; DATA_LOSS, too, where one of them is missing.
absl::StatusOr<StoredState> read_state(const std::string& name, const PathOfPart& path_of, Disk& disk);

}  // namespace tessera
