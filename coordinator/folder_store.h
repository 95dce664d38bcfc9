// A store in a folder: inputs in an SQLite database, states as snapshot files beside it.
#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <memory>

#include "coordinator/world_store.h"
#include "proto/disk.h"

namespace tessera {

// Opens or makes it on `disk`, which must outlive it. ALREADY_EXISTS where another coordinator uses it,
// DATA_LOSS where a file in it is not as it was written, otherwise the system's errors. The lock ends with
// the process, whatever ends it.
absl::StatusOr<std::unique_ptr<WorldStore>> open_folder_store(const std::filesystem::path& folder,
                                                              Disk& disk = system_disk());

}  // namespace tessera
