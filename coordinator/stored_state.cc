#include "coordinator/stored_state.h"

#include <absl/status/statusor.h>

#include <utility>
#include <variant>
#include <vector>

#include "proto/snapshot.h"
#include "proto/snapshot_file.h"

namespace tessera {

absl::Status write_state(const std::filesystem::path& file, const StoredState& state, Disk& disk) {
  if (const auto* chunks = std::get_if<std::vector<v1::SnapshotChunk>>(&state))
    return write_snapshot(file, *chunks, disk);
  std::vector<v1::SnapshotChunk> chunks(1);
  *chunks[0].mutable_world() = std::get<v1::World>(state);
  chunks.push_back(end_chunk(1));
  return write_snapshot(file, chunks, disk);
}

absl::StatusOr<StoredState> read_state(const std::string& name, const PathOfPart& path_of, Disk& disk) {
  absl::StatusOr<std::vector<v1::SnapshotChunk>> chunks = read_parts(name, path_of, disk);
  if (absl::IsNotFound(chunks.status())) return absl::DataLossError(chunks.status().message());
  if (!chunks.ok()) return chunks.status();
  if (chunks->front().has_world()) return std::move(*chunks->front().mutable_world());
  return *std::move(chunks);
}

}  // namespace tessera
