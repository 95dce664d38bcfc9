#include "proto/snapshot_file.h"

#include <absl/strings/str_cat.h>
#include <xxhash.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "proto/whole_file.h"

namespace tessera {
namespace {

constexpr std::string_view kMagic = "tessera snapshot\n";

// Before each chunk.
struct ChunkHeader {
  std::uint32_t bytes = 0;
  std::uint32_t zero = 0;
  std::uint64_t checksum = 0;  // of the chunk; XXH3, seeded with its place and its length
};

std::uint64_t checksum_of(std::string_view bytes, std::uint64_t place) {
  return XXH3_64bits_withSeed(bytes.data(), bytes.size(), place << 32 ^ bytes.size());
}

}  // namespace

absl::StatusOr<std::string> SnapshotEncoder::encode(const v1::SnapshotChunk& chunk) {
  const std::size_t size = chunk.ByteSizeLong();
  if (size == 0 || size > kSnapshotChunkMax) {
    return absl::ResourceExhaustedError(
        absl::StrCat("a chunk of the snapshot has ", size, " bytes, and may have 1 to ", kSnapshotChunkMax));
  }
  std::string bytes(place_ == 0 ? kMagic : std::string_view());
  const std::size_t header_at = bytes.size();
  bytes.reserve(header_at + sizeof(ChunkHeader) + size);
  bytes.resize(header_at + sizeof(ChunkHeader));
  chunk.AppendToString(&bytes);
  const std::string_view contents = std::string_view(bytes).substr(header_at + sizeof(ChunkHeader));
  const ChunkHeader header{static_cast<std::uint32_t>(size), 0, checksum_of(contents, place_++)};
  std::memcpy(bytes.data() + header_at, &header, sizeof header);
  return bytes;
}

// Takes what begins with the magic or a chunk, if it is whole; returns how many bytes that were.
absl::StatusOr<std::size_t> SnapshotDecoder::take(std::string_view bytes) {
  const auto damaged = [&](const char* how) {
    return absl::DataLossError(absl::StrCat("the snapshot's chunk at byte ", at_, " ", how));
  };
  if (at_ == 0) {
    const std::size_t known = std::min(bytes.size(), kMagic.size());
    if (bytes.substr(0, known) != kMagic.substr(0, known)) return absl::DataLossError("this is no snapshot");
    return known == kMagic.size() ? known : 0;
  }
  ChunkHeader header;
  if (bytes.size() < sizeof header) return 0;
  std::memcpy(&header, bytes.data(), sizeof header);
  if (header.bytes == 0 || header.bytes > kSnapshotChunkMax || header.zero != 0) return damaged("is damaged");
  if (!chunks_.empty() && chunks_.back().has_end()) return damaged("follows the end");
  if (bytes.size() - sizeof header < header.bytes) return 0;
  const std::string_view contents = bytes.substr(sizeof header, header.bytes);
  if (checksum_of(contents, chunks_.size()) != header.checksum) return damaged("is damaged");
  v1::SnapshotChunk& chunk = chunks_.emplace_back();
  if (!chunk.ParseFromArray(contents.data(), static_cast<int>(contents.size()))) {
    return damaged("has contents that cannot be read");
  }
  return sizeof header + contents.size();
}

absl::Status SnapshotDecoder::add(std::string_view bytes) {
  rest_.append(bytes);
  std::string_view left = rest_;
  for (;;) {
    const absl::StatusOr<std::size_t> taken = take(left);
    if (!taken.ok()) return taken.status();
    if (*taken == 0) break;
    left.remove_prefix(*taken);
    at_ += *taken;
  }
  rest_.erase(0, rest_.size() - left.size());
  return absl::OkStatus();
}

absl::StatusOr<std::vector<v1::SnapshotChunk>> SnapshotDecoder::finish() {
  if (!rest_.empty() || chunks_.empty() || !chunks_.back().has_end()) {
    return absl::DataLossError(absl::StrCat("the snapshot is cut off after byte ", at_ + rest_.size()));
  }
  return std::move(chunks_);
}

absl::Status write_snapshot(const std::filesystem::path& file, std::span<const v1::SnapshotChunk> chunks,
                            Disk& disk) {
  absl::StatusOr<WholeFile> out = WholeFile::create(file, disk);
  if (!out.ok()) return out.status();
  SnapshotEncoder encoder;
  for (const v1::SnapshotChunk& chunk : chunks) {
    const absl::StatusOr<std::string> bytes = encoder.encode(chunk);
    if (!bytes.ok()) return bytes.status();
    if (absl::Status status = out->append(*bytes); !status.ok()) return status;
  }
  return out->finish();
}

absl::StatusOr<std::vector<v1::SnapshotChunk>> read_snapshot(const std::filesystem::path& file, Disk& disk) {
  SnapshotDecoder decoder;
  absl::Status status = disk.read(file, [&](std::string_view bytes) { return decoder.add(bytes); });
  if (status.ok()) {
    absl::StatusOr<std::vector<v1::SnapshotChunk>> chunks = decoder.finish();
    if (chunks.ok()) return chunks;
    status = chunks.status();
  }
  if (!absl::IsDataLoss(status)) return status;
  return absl::DataLossError(absl::StrCat(file.string(), ": ", status.message()));
}

}  // namespace tessera
