#include "sector_server/changed_chunks.h"

#include <algorithm>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "lpss/partition/world_state.h"
#include "proto/wire.h"

namespace tessera {
namespace {

using Chunk = v1::SnapshotChunk;

// Those that may have changed: all that are not packed, those that were not, and those that have been packed
// or brought back since, even if both.
std::vector<SectorIndex> candidates(Partition& partition, bool anew,
                                    std::vector<SectorIndex> unpacked_before) {
  std::optional<std::vector<SectorIndex>> packed = partition.packed.take_changed();
  if (anew || !packed) packed = partition.packed.sectors();
  std::vector<SectorIndex> all = std::move(unpacked_before);
  all.insert(all.end(), packed->begin(), packed->end());
  for (const auto& [index, sector] : partition.sectors) all.push_back(index);
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

Chunk absence(std::string key) {
  Chunk chunk;
  chunk.set_key(std::move(key));
  return chunk;
}

}  // namespace

void ChangedChunks::collect(Partition& partition, bool anew, bool with_shared, const Take& take) {
  if (anew) {
    sent_.restart();
    shared_blocks_ = 0;
  }
  if (with_shared) add_shared(pack(shared_state(partition)), take);
  for (const SectorIndex& index : candidates(partition, anew, std::exchange(unpacked_, {}))) {
    std::string key = sector_key(index);
    const auto sector = partition.sectors.find(index);
    std::optional<MovedSector> moved;
    if (sector != partition.sectors.end()) {
      moved = pack_sector(partition, *sector->second);
      unpacked_.push_back(index);
    } else if (partition.packed.contains(index)) {
      moved = partition.packed.copy(index);
    }
    if (!moved) {
      if (sent_.forget(key)) take(absence(std::move(key)));
      continue;
    }
    moved = with_parts(partition, *std::move(moved));
    std::string bytes = pack(std::span<const MovedSector>(&*moved, 1));
    if (!sent_.is_new(key, bytes)) continue;
    Chunk chunk;
    chunk.set_key(std::move(key));
    chunk.set_sectors(std::move(bytes));
    take(std::move(chunk));
  }
}

void ChangedChunks::add_shared(std::string_view bytes, const Take& take) {
  std::size_t block = 0;
  for (; !bytes.empty(); ++block) {
    const std::string_view contents = bytes.substr(0, kSharedBlockBytes);
    bytes.remove_prefix(contents.size());
    std::string key = chunk_key(Chunk::kShared, block);
    if (!sent_.is_new(key, contents)) continue;
    Chunk chunk;
    chunk.set_key(std::move(key));
    chunk.set_shared(std::string(contents));
    take(std::move(chunk));
  }
  for (std::size_t gone = block; gone < shared_blocks_; ++gone) {
    std::string key = chunk_key(Chunk::kShared, gone);
    sent_.forget(key);
    take(absence(std::move(key)));
  }
  shared_blocks_ = block;
}

}  // namespace tessera
