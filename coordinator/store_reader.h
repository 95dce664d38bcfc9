// What is in a store of a folder, read without a change to it.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "coordinator/input_log.h"
#include "coordinator/world_store.h"
#include "proto/disk.h"

namespace tessera {

// The files of a store by their numbers.
class StoreFiles {
 public:
  explicit StoreFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}

  const std::filesystem::path& folder() const { return folder_; }
  std::filesystem::path lock() const;
  std::filesystem::path state(const std::string& name) const;
  InputLogFiles log(std::uint64_t number) const;
  std::filesystem::path aside() const;         // the folder of the last world that could not go on
  std::filesystem::path aside_reason() const;  // a file in it
  // Whether a store writes files of this name: states, logs, and what is unfinished of them.
  static bool is_ours(const std::filesystem::path& file);

 private:
  std::filesystem::path folder_;
};

// A log, and what damage to it there is.
struct FoundLog {
  std::uint64_t number = 0;
  ReadInputLog read;
};

struct StoreContents {
  std::vector<FoundLog> logs;            // those that are needed, oldest first; none in an empty store
  std::vector<v1::StoredInput> inputs;   // that the state lacks
  std::uint64_t position = 0;            // of the last of them
  std::uint64_t last_log = 0;            // the highest number of those that are there
  std::string lost;                      // which inputs are, that were acknowledged; empty: none
  absl::StatusOr<StoredState> state;     // NOT_FOUND where there is no world; DATA_LOSS with what is damaged
  std::vector<std::string> state_files;  // by name

  bool has_world() const { return !absl::IsNotFound(state.status()); }
  // Of the last log.
  const v1::InputLogHead& head() const { return logs.back().read.head; }
  // Damage for which a copy stands: one line each.
  std::vector<std::string> damage() const;
};

// DATA_LOSS where nobody can tell what the world was, FAILED_PRECONDITION for a store of another format,
// otherwise the disk's errors.
absl::StatusOr<StoreContents> read_store(const StoreFiles& files, Disk& disk);

// What damage there is to logs goes.
absl::Status mend_logs(const StoreFiles& files, const StoreContents& contents, Disk& disk);

}  // namespace tessera
