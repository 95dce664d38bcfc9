// A coordinator's own copies of states of the world: those that it made while it led, and those that it was
// sent while it stood by.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "coordinator/state_parts.h"
#include "coordinator/world_store.h"
#include "proto/whole_file.h"

namespace tessera {

// Safe to use from any thread. One process at a time has a folder.
class StateFolder {
 public:
  // Opens or makes it. ALREADY_EXISTS where another process has it, UNAVAILABLE with the system's reason.
  static absl::StatusOr<std::unique_ptr<StateFolder>> open(std::filesystem::path folder);
  StateFolder(const StateFolder&) = delete;
  StateFolder& operator=(const StateFolder&) = delete;

  // Of this coordinator, drawn at random when the folder was made.
  const std::string& coordinator() const { return coordinator_; }

  // Whole ones. A state may be several files (coordinator/state_parts.h), of which the last has its name.
  bool holds(const std::string& name) const;
  // The files of a state, oldest first, as far as they are known; those that are here.
  std::vector<std::string> files_of(const std::string& name) const;
  std::set<std::string> files() const;
  std::filesystem::path path_of(const std::string& name) const;

  // On return, it is on disk.
  absl::Status write(const std::string& name, const StoredState& state);
  // As write_part().
  absl::Status write_change(const StatePart& part, const StateChange& change);
  // DATA_LOSS where it is not as it was written: it then no longer counts as held.
  absl::StatusOr<StoredState> read(const std::string& name);

  // A copy of another coordinator's file; `add` it once it is finished.
  absl::StatusOr<WholeFile> create(const std::string& name) const { return WholeFile::create(path_of(name)); }
  void add(const std::string& name);

  // Removes files that were made before state `name`, as far as this does not need them: names count up.
  void drop_before(const std::string& name);

 private:
  StateFolder(std::filesystem::path folder, std::unique_ptr<Disk::Lock> lock)
      : folder_(std::move(folder)), lock_(std::move(lock)) {}
  absl::Status scan();

  const std::filesystem::path folder_;
  const std::unique_ptr<Disk::Lock> lock_;
  std::string coordinator_;
  mutable std::mutex mutex_;
  std::map<std::string, std::vector<std::string>> files_;  // each with those before it of its state
};

// Names that leaders give: hexadecimal digits and dashes.
bool is_state_name(std::string_view name);

}  // namespace tessera
