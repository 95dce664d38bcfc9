// What a server contributes to checkpoints of its world: what has changed since the last one.
#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "lpss/partition/partition.h"
#include "proto/kept_chunks.h"

namespace tessera {

class ChangedChunks {
 public:
  using Take = std::function<void(v1::SnapshotChunk)>;

  // Calls `take` for chunks under keys (proto/kept_chunks.h): for all of the partition's, or those that have
  // changed since the last call. Between ticks. Of sectors that were packed all the time nothing is even
  // looked at. `with_shared`: what all sectors share, too.
  void collect(Partition& partition, bool anew, bool with_shared, const Take& take);

 private:
  void add_shared(std::string_view bytes, const Take& take);

  ChunkChanges sent_;
  std::vector<SectorIndex> unpacked_;  // those that were not packed at the last call
  std::size_t shared_blocks_ = 0;      // sent
};

}  // namespace tessera
