#include "proto/kept_chunks.h"

#include <xxhash.h>

#include <limits>
#include <set>
#include <utility>

#include "proto/snapshot.h"

namespace tessera {
namespace {

using Chunk = v1::SnapshotChunk;

constexpr std::size_t kNumberBytes = 8;
constexpr std::uint64_t kSignBit = std::uint64_t{1} << 63;

// Big-endian, so that the order of bytes is that of the numbers.
void append_number(std::uint64_t number, std::string& key) {
  for (std::size_t n = kNumberBytes; n-- > 0;) key.push_back(static_cast<char>(number >> (8 * n)));
}

std::uint64_t number_in(std::string_view key, std::size_t begin) {
  std::uint64_t number = 0;
  for (const char byte : key.substr(begin, kNumberBytes))
    number = number << 8 | static_cast<std::uint8_t>(byte);
  return number;
}

bool is_of(std::string_view key, Chunk::KindCase kind) {
  return !key.empty() && static_cast<std::uint8_t>(key.front()) == kind;
}

}  // namespace

void put(KeptChunk chunk, KeptChunks& chunks) {
  chunks.erase(std::string_view(chunk->key()));  // the key is that of the chunk itself
  const std::string_view key = chunk->key();
  chunks.emplace(key, std::move(chunk));
}

void apply(const KeptChunk& chunk, KeptChunks& state) {
  if (is_absence(*chunk)) {
    state.erase(std::string_view(chunk->key()));
  } else {
    put(chunk, state);
  }
}

KeptChunk absence_of(std::string_view key) {
  auto chunk = std::make_shared<Chunk>();
  chunk->set_key(std::string(key));
  return chunk;
}

std::string chunk_key(Chunk::KindCase kind, std::uint64_t n) {
  std::string key(1, static_cast<char>(kind));
  append_number(n, key);
  return key;
}

std::string sector_key(const SectorIndex& sector) {
  std::string key(1, static_cast<char>(Chunk::kSectors));
  for (const std::int64_t n : {sector.i, sector.j, sector.k})
    append_number(static_cast<std::uint64_t>(n) ^ kSignBit, key);
  if (sector.frame != kWorldFrame) append_number(sector.frame, key);
  return key;
}

std::optional<SectorIndex> sector_of_key(std::string_view key) {
  const bool has_frame = key.size() == 1 + 4 * kNumberBytes;
  if (!is_of(key, Chunk::kSectors) || (!has_frame && key.size() != 1 + 3 * kNumberBytes)) return std::nullopt;
  const auto number = [&](std::size_t n) {
    return static_cast<std::int64_t>(number_in(key, 1 + n * kNumberBytes) ^ kSignBit);
  };
  const std::uint64_t frame = has_frame ? number_in(key, 1 + 3 * kNumberBytes) : kWorldFrame;
  if (frame > std::numeric_limits<FrameNumber>::max()) return std::nullopt;
  return SectorIndex{number(0), number(1), number(2), static_cast<FrameNumber>(frame)};
}

ChunkDigest digest_of(std::string_view bytes) {
  const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
  return {hash.low64, hash.high64};
}

bool ChunkChanges::is_new(const std::string& key, std::string_view contents) {
  const ChunkDigest digest = digest_of(contents);
  const auto [place, is_added] = had_.try_emplace(key, digest);
  return is_added || std::exchange(place->second, digest) != digest;
}

void ChunkChanges::compare(std::vector<Chunk> all, const std::function<void(KeptChunk)>& take) {
  std::set<std::string> there;
  for (Chunk& chunk : all) {
    there.insert(chunk.key());
    if (!is_new(chunk.key(), chunk.SerializeAsString())) continue;
    take(std::make_shared<const Chunk>(std::move(chunk)));
  }
  absl::erase_if(had_, [&](const auto& entry) {
    if (there.contains(entry.first)) return false;
    take(absence_of(entry.first));
    return true;
  });
}

std::string shared_bytes(const KeptChunks& state) {
  std::string bytes;
  for (const auto& [key, chunk] : state) {
    if (chunk->has_shared()) bytes += chunk->shared();
  }
  return bytes;
}

std::vector<Chunk> snapshot_of(const KeptChunks& state) {
  std::vector<Chunk> chunks;
  for (const auto& [key, kept] : state) {
    if (kept->has_shared() && !chunks.empty() && chunks.back().has_shared()) {
      chunks.back().mutable_shared()->append(kept->shared());
      continue;
    }
    chunks.push_back(*kept);
    chunks.back().clear_key();
  }
  chunks.push_back(end_chunk(chunks.size()));
  return chunks;
}

}  // namespace tessera
