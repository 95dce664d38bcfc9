#include "coordinator/state_parts.h"

#include <memory>
#include <utility>

#include "proto/snapshot.h"
#include "proto/snapshot_file.h"
#include "proto/whole_file.h"

namespace tessera {
namespace {

using Chunk = v1::SnapshotChunk;

// Files stay as they are while there are at most so many, and they have at most so many times the bytes of
// the state. Otherwise those are merged whose chunks that count are at most so many times as large as what
// comes after them: each byte of a change is written again only when what follows has become large beside it.
constexpr std::size_t kFilesKept = 4;
constexpr std::uint64_t kTimesTheState = 2;
constexpr std::uint64_t kTimesTheLater = 2;
constexpr std::uint64_t kFileBytes = 4096;  // what a file costs beyond its contents, as it were

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

// The chunks of the change are those that count from now on.
void StateParts::take_newest(const StateChange& change, File& next) {
  for (const auto& [view, chunk] : change.chunks) {
    std::string key(view);
    for (File& file : files_) {
      const auto found = file.newest.find(key);
      if (found == file.newest.end()) continue;
      file.newest_bytes -= found->second;
      file.newest.erase(found);
    }
    const std::uint64_t bytes = is_absence(*chunk) ? 0 : chunk->ByteSizeLong();
    next.newest.emplace(std::move(key), bytes);
    next.newest_bytes += bytes;
  }
  next.bytes = kFileBytes + next.newest_bytes;
  std::erase_if(files_, [](const File& file) { return file.newest.empty(); });
}

bool StateParts::has_room(const File& next) const {
  std::uint64_t bytes = next.bytes;
  std::uint64_t newest = next.newest_bytes;
  for (const File& file : files_) {
    bytes += file.bytes;
    newest += file.newest_bytes;
  }
  return files_.size() < kFilesKept && bytes <= kTimesTheState * newest;
}

StatePart StateParts::add(const std::string& name, const StateChange& change) {
  if (change.is_whole) files_.clear();
  File next{.name = name, .bytes = 0, .newest = {}, .newest_bytes = 0};
  take_newest(change, next);
  StatePart part{.name = name, .kept = {}, .merged = {}};
  if (!has_room(next)) {
    while (!files_.empty() && files_.back().newest_bytes <= kTimesTheLater * next.bytes) {
      File& last = files_.back();
      next.bytes += last.newest_bytes;
      next.newest_bytes += last.newest_bytes;
      next.newest.merge(last.newest);
      part.merged.insert(part.merged.begin(), std::move(last.name));
      files_.pop_back();
    }
  }
  for (const File& file : files_) part.kept.push_back(file.name);
  if (files_.empty()) absl::erase_if(next.newest, [](const auto& entry) { return entry.second == 0; });
  files_.push_back(std::move(next));
  return part;
}

absl::Status write_part(const StatePart& part, const StateChange& change, const PathOfPart& path_of,
                        Disk& disk) {
  KeptChunks merged;
  for (const std::string& name : part.merged) {
    absl::StatusOr<std::vector<Chunk>> chunks = read_snapshot(path_of(name), disk);
    if (!chunks.ok()) return chunks.status();
    put_all(*std::move(chunks), merged);
  }
  for (const auto& [key, chunk] : change.chunks) put(chunk, merged);
  if (part.kept.empty()) remove_absences(merged);

  absl::StatusOr<WholeFile> file = WholeFile::create(path_of(part.name), disk);
  if (!file.ok()) return file.status();
  SnapshotEncoder encoder;
  const auto append = [&](const Chunk& chunk) {
    const absl::StatusOr<std::string> bytes = encoder.encode(chunk);
    if (!bytes.ok()) return bytes.status();
    return file->append(*bytes);
  };
  Chunk before;
  for (const std::string& name : part.kept) before.mutable_parts()->add_names(name);
  absl::Status status = part.kept.empty() ? absl::OkStatus() : append(before);
  for (auto chunk = merged.begin(); status.ok() && chunk != merged.end(); ++chunk)
    status = append(*chunk->second);
  if (status.ok()) status = append(end_chunk(merged.size()));
  return status.ok() ? file->finish() : status;
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
