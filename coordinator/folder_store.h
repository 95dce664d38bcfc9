// A store in a folder: inputs in logs (coordinator/input_log.h), states as snapshot files beside them. Each
// byte is checked when it is read: what is damaged is made good by a mirror, or an error, and never taken for
// less.
#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <memory>

#include "coordinator/store_reader.h"
#include "coordinator/world_store.h"
#include "proto/disk.h"

namespace tessera {

// Opens or makes it on `disk`, which must outlive it. ALREADY_EXISTS where another coordinator uses it,
// DATA_LOSS where a file in it is missing or not as it was written, FAILED_PRECONDITION for a store of
// another format, otherwise the system's errors. The lock ends with the process, whatever ends it.
absl::StatusOr<std::unique_ptr<WorldStore>> open_folder_store(const std::filesystem::path& folder,
                                                              Disk& disk = system_disk());

// What is in the store, of which nothing is changed. NOT_FOUND where there is none; errors as read_store(),
// and as open_folder_store() where a coordinator uses it.
absl::StatusOr<StoreContents> check_folder_store(const std::filesystem::path& folder,
                                                 Disk& disk = system_disk());

// Makes a store that has lost inputs one that has its state, and the inputs before the first that is lost.
// NOT_FOUND where it has no world, DATA_LOSS where its state, or which one that is, is lost; errors as
// open_folder_store().
absl::Status drop_what_is_lost(const std::filesystem::path& folder, Disk& disk = system_disk());

}  // namespace tessera
