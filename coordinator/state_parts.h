// States of a world as files of which each has only what has changed since those before it, so that a
// checkpoint writes about as much as has changed. A file of which nothing is left that later ones do not have
// is dropped unread, as all are where a whole world moves. Where there are many files, or they are large
// beside the state, those that are small beside what comes are merged with it.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "coordinator/world_store.h"
#include "proto/disk.h"

namespace tessera {

// A file that is to be written: which others of its state stay, and which are merged into it. Oldest first.
struct StatePart {
  std::string name;
  std::vector<std::string> kept;
  std::vector<std::string> merged;
};

// What the files of a state have, as they are written one after the other.
class StateParts {
 public:
  // Plans the file `name`, which has the change. The first change is whole, and so is the one after a file
  // that could not be written.
  StatePart add(const std::string& name, const StateChange& change);

 private:
  struct File {
    std::string name;
    std::uint64_t bytes = 0;  // about
    // Keys that no later file has, and the bytes of their chunks; 0 for an absence.
    absl::flat_hash_map<std::string, std::uint64_t> newest;
    std::uint64_t newest_bytes = 0;
  };

  void take_newest(const StateChange& change, File& next);
  bool has_room(const File& next) const;

  std::vector<File> files_;
};

using PathOfPart = std::function<std::filesystem::path(const std::string& name)>;

// Writes a file as it was planned for the change. Errors as WholeFile, DATA_LOSS where a file to be merged is
// not as it was written.
absl::Status write_part(const StatePart& part, const StateChange& change, const PathOfPart& path_of,
                        Disk& disk);

// The files before this one of its state, oldest first; none of a file that has all of a state, or is no part
// of one. Only the beginning of the file is read.
std::vector<std::string> parts_before(const std::filesystem::path& file, Disk& disk);

// All chunks of the snapshot that a file and those before it are. Errors as read_snapshot().
absl::StatusOr<std::vector<v1::SnapshotChunk>> read_parts(const std::string& name, const PathOfPart& path_of,
                                                          Disk& disk);

}  // namespace tessera
