// Snapshots as bytes: chunks (snapshot.proto), each with its length and checksum. Files hold them, and
// clients pass them on as they are.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/disk.h"
#include "snapshot.pb.h"

namespace tessera {

class SnapshotEncoder {
 public:
  // RESOURCE_EXHAUSTED for a chunk beyond kSnapshotChunkMax.
  absl::StatusOr<std::string> encode(const v1::SnapshotChunk& chunk);

 private:
  std::uint64_t place_ = 0;
};

// Takes bytes in pieces of any size.
class SnapshotDecoder {
 public:
  // DATA_LOSS, with the byte, where they are no snapshot, or any byte is not as written. Nothing may be added
  // after that.
  absl::Status add(std::string_view bytes);

  // Those that are whole so far.
  const std::vector<v1::SnapshotChunk>& chunks() const { return chunks_; }

  // DATA_LOSS where the end is missing.
  absl::StatusOr<std::vector<v1::SnapshotChunk>> finish();

 private:
  absl::StatusOr<std::size_t> take(std::string_view bytes);

  std::string rest_;      // of a chunk that is not whole yet
  std::uint64_t at_ = 0;  // bytes taken
  std::vector<v1::SnapshotChunk> chunks_;
};

inline constexpr std::size_t kSnapshotChunkMax = std::size_t{1} << 30;  // bytes

// As WholeFile, with errors of SnapshotEncoder.
absl::Status write_snapshot(const std::filesystem::path& file, std::span<const v1::SnapshotChunk> chunks,
                            Disk& disk = system_disk());

// The system's error if the file cannot be read; DATA_LOSS as SnapshotDecoder.
absl::StatusOr<std::vector<v1::SnapshotChunk>> read_snapshot(const std::filesystem::path& file,
                                                             Disk& disk = system_disk());

}  // namespace tessera
