#include "coordinator/state_parts.h"

#include <memory>
#include <utility>

#include "proto/snapshot.h"
#include "proto/snapshot_file.h"
#include "proto/whole_file.h"

namespace tessera {
namespace {

using Chunk = v1::SnapshotChunk;

// A file is merged with what comes after it unless it is more than so many times as large: each byte of a
// change is written again only when what follows has become large beside it.
constexpr std::uint64_t kLargerTimes = 2;
constexpr std::uint64_t kFileBytes = 4096;  // what a file costs beyond its contents, as it were

std::uint64_t bytes_of(const StateChange& change) {
  std::uint64_t bytes = 0;
  for (const auto& [key, chunk] : change.chunks) bytes += chunk->ByteSizeLong();
  return bytes;
}

// The chunks of a file take the places of those before.
void put_all(std::vector<Chunk> chunks, KeptChunks& to) {
  for (Chunk& chunk : chunks) {
    if (chunk.has_parts() || chunk.has_end()) continue;
    put(std::make_shared<const Chunk>(std::move(chunk)), to);
  }
}

void remove_absences(KeptChunks& state) {
  absl::erase_if(state, [](const auto& entry) { return is_absence(*entry.second); });
}

}  // namespace

std::size_t parts_to_keep(std::span<const StatePart> parts, const StateChange& change) {
  if (change.is_whole) return 0;
  std::uint64_t bytes = bytes_of(change) + kFileBytes;
  std::size_t kept = parts.size();
  for (; kept > 0 && parts[kept - 1].bytes <= kLargerTimes * bytes; --kept) bytes += parts[kept - 1].bytes;
  return kept;
}

absl::StatusOr<std::uint64_t> write_part(const std::string& name, std::span<const StatePart> parts,
                                         std::size_t kept, const StateChange& change,
                                         const PathOfPart& path_of, Disk& disk) {
  KeptChunks merged;
  if (!change.is_whole) {
    for (const StatePart& part : parts.subspan(kept)) {
      absl::StatusOr<std::vector<Chunk>> chunks = read_snapshot(path_of(part.name), disk);
      if (!chunks.ok()) return chunks.status();
      put_all(*std::move(chunks), merged);
    }
  }
  for (const auto& [key, chunk] : change.chunks) put(chunk, merged);
  if (kept == 0) remove_absences(merged);

  absl::StatusOr<WholeFile> file = WholeFile::create(path_of(name), disk);
  if (!file.ok()) return file.status();
  SnapshotEncoder encoder;
  std::uint64_t written = 0;
  const auto append = [&](const Chunk& chunk) {
    const absl::StatusOr<std::string> bytes = encoder.encode(chunk);
    if (!bytes.ok()) return bytes.status();
    written += bytes->size();
    return file->append(*bytes);
  };
  Chunk before;
  for (const StatePart& part : parts.first(kept)) before.mutable_parts()->add_names(part.name);
  absl::Status status = kept > 0 ? append(before) : absl::OkStatus();
  for (auto chunk = merged.begin(); status.ok() && chunk != merged.end(); ++chunk)
    status = append(*chunk->second);
  if (status.ok()) status = append(end_chunk(merged.size()));
  if (status.ok()) status = file->finish();
  if (!status.ok()) return status;
  return written;
}

std::vector<std::string> parts_before(const std::filesystem::path& file, Disk& disk) {
  SnapshotDecoder decoder;
  const absl::Status whole_or_not = disk.read(file, [&](std::string_view bytes) {
    const absl::Status status = decoder.add(bytes);
    return decoder.chunks().empty() ? status : absl::CancelledError("the first is enough");
  });
  whole_or_not.IgnoreError();
  if (decoder.chunks().empty()) return {};
  const auto& names = decoder.chunks().front().parts().names();
  return {names.begin(), names.end()};
}

absl::StatusOr<std::vector<Chunk>> read_parts(const std::string& name, const PathOfPart& path_of,
                                              Disk& disk) {
  absl::StatusOr<std::vector<Chunk>> last = read_snapshot(path_of(name), disk);
  if (!last.ok()) return last.status();
  const Chunk& first = last->front();
  if (first.key().empty() && !first.has_parts()) return last;  // a snapshot as clients have it
  KeptChunks state;
  for (const std::string& part : first.parts().names()) {
    absl::StatusOr<std::vector<Chunk>> chunks = read_snapshot(path_of(part), disk);
    if (!chunks.ok()) return chunks.status();
    put_all(*std::move(chunks), state);
  }
  put_all(*std::move(last), state);
  remove_absences(state);
  return snapshot_of(state);
}

}  // namespace tessera
