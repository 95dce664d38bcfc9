// States of a world as files of which each has only what has changed since those before it, so that a
// checkpoint writes about as much as has changed. Files that are small beside what comes are merged with it:
// there are few of them, and together they are at most some times as large as the state.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "coordinator/world_store.h"
#include "proto/disk.h"

namespace tessera {

// One of the files of a state: all of it, or what has changed since the files before.
struct StatePart {
  std::string name;
  std::uint64_t bytes = 0;
};

using PathOfPart = std::function<std::filesystem::path(const std::string& name)>;

// How many of the files of a state stay as they are where a change comes; the later ones are merged with it.
std::size_t parts_to_keep(std::span<const StatePart> parts, const StateChange& change);

// Writes one more file `name` of a state, which takes the place of those after the first `kept`. Returns its
// bytes. Errors as WholeFile, DATA_LOSS where a file to be merged is not as it was written.
absl::StatusOr<std::uint64_t> write_part(const std::string& name, std::span<const StatePart> parts,
                                         std::size_t kept, const StateChange& change,
                                         const PathOfPart& path_of, Disk& disk);

// The files before this one of its state, oldest first; none of a file that has all of a state, or is no part
// of one. Only the beginning of the file is read.
std::vector<std::string> parts_before(const std::filesystem::path& file, Disk& disk);

// All chunks of the snapshot that a file and those before it are. Errors as read_snapshot().
absl::StatusOr<std::vector<v1::SnapshotChunk>> read_parts(const std::string& name, const PathOfPart& path_of,
                                                          Disk& disk);

}  // namespace tessera
