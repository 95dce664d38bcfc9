// What tests of the stores write, and what they find again.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/world_store.h"
#include "proto/snapshot.h"

namespace tessera {

inline v1::StoredInput stored_removal(Tick tick) {
  v1::StoredInput input;
  input.mutable_commands()->set_tick(tick);
  input.mutable_commands()->add_commands()->mutable_remove()->mutable_body()->set_id(tick);
  return input;
}

inline std::vector<Tick> ticks_of(const std::optional<StoredWorld>& world) {
  std::vector<Tick> ticks;
  if (!world) return ticks;
  for (const v1::StoredInput& input : world->inputs) ticks.push_back(input.commands().tick());
  return ticks;
}

inline SnapshotChunks snapshot_of(Tick tick) {
  SnapshotChunks chunks(1);
  chunks[0].mutable_head()->set_tick(tick);
  chunks.push_back(end_chunk(1));
  return chunks;
}

// The same as a state that takes the place of all that is stored.
inline StateChange state_of(Tick tick) {
  StateChange state{.is_whole = true, .chunks = {}};
  auto chunk = std::make_shared<v1::SnapshotChunk>();
  chunk->set_key(chunk_key(v1::SnapshotChunk::kHead));
  chunk->mutable_head()->set_tick(tick);
  put(std::move(chunk), state.chunks);
  return state;
}

inline KeptChunk sector_chunk(std::int64_t sector, std::string bytes) {
  auto chunk = std::make_shared<v1::SnapshotChunk>();
  chunk->set_key(sector_key({sector, 0, 0}));
  chunk->set_sectors(std::move(bytes));
  return chunk;
}

}  // namespace tessera
