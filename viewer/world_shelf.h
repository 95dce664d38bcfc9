// The worlds that the web UI offers to load, and the snapshots that it keeps: files of two folders, by name.
// A name never leads out of its folder.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace tessera::viewer {

inline constexpr std::size_t kShelfMax = 100;  // worlds, and snapshots
inline constexpr std::size_t kSnapshotNameMax = 64;

struct ShelfWorld {
  std::string name;  // of the file, without ".sdf"
  std::string text;  // the first sentence of its first comment; may be empty
};

struct ShelfSnapshot {
  std::string name;  // of the file, without ".snapshot"
  std::uint64_t bytes = 0;
};

// Thread-safe.
class WorldShelf {
 public:
  // An empty path: nothing of that kind. Folders need not exist: that of snapshots is made for the first one.
  WorldShelf(std::filesystem::path worlds, std::filesystem::path snapshots);

  // Ascending by name, the first kShelfMax.
  std::vector<ShelfWorld> worlds() const;
  std::vector<ShelfSnapshot> snapshots() const;
  bool keeps_snapshots() const { return !snapshots_.empty(); }

  // NOT_FOUND for any name that worlds() does not have, or snapshots().
  absl::StatusOr<std::filesystem::path> world(const std::string& name) const;
  absl::StatusOr<std::filesystem::path> snapshot(const std::string& name) const;

  // The file for a snapshot of that name. INVALID_ARGUMENT for a name with other characters than letters,
  // digits, '-', '_' and '.', with one of the last three in front, or of more than kSnapshotNameMax;
  // ALREADY_EXISTS; RESOURCE_EXHAUSTED with kShelfMax of them; FAILED_PRECONDITION without a folder.
  absl::StatusOr<std::filesystem::path> new_snapshot(const std::string& name) const;

 private:
  std::filesystem::path worlds_;
  std::filesystem::path snapshots_;
};

// The file of a name that is to be made in a folder, which is made, too. Errors as of new_snapshot(), for
// which `kind` is "snapshot".
absl::StatusOr<std::filesystem::path> new_file(const std::filesystem::path& folder, const std::string& name,
                                               const char* extension, const char* kind);

// The worlds that this program was installed or built with; empty if they are not there.
std::filesystem::path worlds_of_installation(const std::filesystem::path& executable_folder);

// Where programs of this user keep their state ($STATE_DIRECTORY, $XDG_STATE_HOME, or ~/.local/state); empty
// if nothing tells.
std::filesystem::path snapshots_of_user();
std::filesystem::path recordings_of_user();

}  // namespace tessera::viewer
