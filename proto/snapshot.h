// Snapshots of worlds as chunks (snapshot.proto), and back.
#pragma once

#include <absl/status/statusor.h>

#include <span>
#include <vector>

#include "lpss/snapshot/world_catalogue.h"
#include "snapshot.pb.h"

namespace tessera {

// A chunk ends with the sector, or the like, that passes this size.
inline constexpr std::size_t kSnapshotChunkBytes = std::size_t{4} << 20;

// What the owner of the sequence contributes: the chunks before the shared state. `shapes` are those of the
// world; held ones follow.
std::vector<v1::SnapshotChunk> head_chunks(const WorldCatalogue& catalogue, const WorldSettings& settings,
                                           const SectorIndex& anchor, Tick tick,
                                           std::span<const ShapeEntry> shapes);

// The same by what changes when, under keys (proto/kept_chunks.h): the head and what is held, which are
// others at each tick, and what only some commands change. `shapes` are all, those of held commands included.
v1::SnapshotChunk head_chunk(const WorldCatalogue& catalogue, const WorldSettings& settings,
                             const SectorIndex& anchor, Tick tick);
std::vector<v1::SnapshotChunk> held_chunks(const WorldCatalogue& catalogue);
std::vector<v1::SnapshotChunk> catalogue_chunks(const WorldCatalogue& catalogue,
                                                std::span<const ShapeEntry> shapes);
std::vector<ShapeEntry> with_held_shapes(const WorldCatalogue& catalogue, std::span<const ShapeEntry> shapes);

// What a server contributes: the state that all share, and the sectors that it hosts.
v1::SnapshotChunk shared_chunk(const SharedState& state);
class SectorChunks {
 public:
  void add(MovedSector sector);
  std::vector<v1::SnapshotChunk> finish();

 private:
  void end_chunk();

  std::vector<MovedSector> sectors_;  // of the chunk to come
  std::size_t bytes_ = 0;
  std::vector<v1::SnapshotChunk> chunks_;
};

v1::SnapshotChunk end_chunk(std::size_t chunks_before);

// All of them.
std::vector<v1::SnapshotChunk> chunks_of(const WorldSnapshot& world, const WorldCatalogue& catalogue);

struct ReadSnapshot {
  WorldSnapshot world;
  WorldCatalogue catalogue;
};

// All of a world; sectors may come in any order. FAILED_PRECONDITION for the snapshot of another version or
// arithmetic, DATA_LOSS for chunks that are missing, surplus or unreadable, otherwise errors as validate().
absl::StatusOr<ReadSnapshot> from_chunks(std::span<const v1::SnapshotChunk> chunks);

}  // namespace tessera
