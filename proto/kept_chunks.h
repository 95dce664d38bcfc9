// The state of a world as chunks under keys, so that from one checkpoint to the next only those need to be
// sent, kept and written that have changed: one a sector, blocks of what all sectors share, and pieces of
// what the coordinator knows.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/container/flat_hash_map.h>
#include <absl/status/statusor.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lpss/grid/sector_index.h"
#include "snapshot.pb.h"

namespace tessera {

// Immutable, since checkpoints share it. One of no kind stands for the absence of its key.
using KeptChunk = std::shared_ptr<const v1::SnapshotChunk>;

// By keys, whose order is that of the chunks of a snapshot.
using KeptChunks = absl::btree_map<std::string_view, KeptChunk>;

// Puts the chunk in the place of one of the same key.
void put(KeptChunk chunk, KeptChunks& chunks);

// Likewise, of a state: a chunk that stands for absence removes the other one.
void apply(const KeptChunk& chunk, KeptChunks& state);

inline bool is_absence(const v1::SnapshotChunk& chunk) {
  return chunk.kind_case() == v1::SnapshotChunk::KIND_NOT_SET;
}
KeptChunk absence_of(std::string_view key);

// The key of the chunk number `n` of its kind.
std::string chunk_key(v1::SnapshotChunk::KindCase kind, std::uint64_t n = 0);
std::string sector_key(const SectorIndex& sector);
// The sector whose key it is; nothing for another key.
std::optional<SectorIndex> sector_of_key(std::string_view key);

// The shared state as blocks: bytes in front that are what they were are not sent again.
inline constexpr std::size_t kSharedBlockBytes = std::size_t{256} << 10;

// What a digest tells apart from all else that a world has.
using ChunkDigest = std::array<std::uint64_t, 2>;
ChunkDigest digest_of(std::string_view bytes);

// Knows by their digests which chunks somebody has, and finds those that have changed.
class ChunkChanges {
 public:
  // Nobody has anything.
  void restart() { had_.clear(); }

  // Whether a chunk with such contents, under this key, is not there already; from now on it is.
  bool is_new(const std::string& key, std::string_view contents);
  // Whether there was one with this key; from now on there is none.
  bool forget(const std::string& key) { return had_.erase(key) > 0; }

  // Calls `take` for each of `all`, which are all that there are now, that is new, and with the absence of
  // those that are gone.
  void compare(std::vector<v1::SnapshotChunk> all, const std::function<void(KeptChunk)>& take);

 private:
  absl::flat_hash_map<std::string, ChunkDigest> had_;
};

// The chunks of a state in the order of a snapshot, without their keys and with an end.
std::vector<v1::SnapshotChunk> snapshot_of(const KeptChunks& state);

// The bytes of the shared state, from its blocks.
std::string shared_bytes(const KeptChunks& state);

}  // namespace tessera
