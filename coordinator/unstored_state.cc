#include "coordinator/unstored_state.h"

#include <vector>

#include "proto/snapshot.h"

namespace tessera {

void UnstoredState::restart() {
  *this = {};
  change_.is_whole = true;
}

void UnstoredState::take_down(const ActiveWorld& world) {
  const auto take = [&](KeptChunk chunk) { put(std::move(chunk), change_.chunks); };
  const Tick tick = world.sequencer.certain();
  const WorldCatalogue brief = with_held(world, world.registry.next_ids());
  SnapshotChunks head = held_chunks(brief);
  head.push_back(head_chunk(brief, world.settings(), world.anchor, tick));
  head_.compare(std::move(head), take);
  // Shapes leave some ticks after the change that takes their last body.
  const std::vector<ShapeEntry> shapes = with_held_shapes(brief, world.registry.shapes().at(tick));
  const std::pair changes(world.registry.changes(), shapes.size());
  if (catalogue_changes_ == changes) return;
  catalogue_changes_ = changes;
  catalogue_.compare(catalogue_chunks(world.registry.catalogue(), shapes), take);
}

void UnstoredState::add(const KeptChunks& chunks) {
  for (const auto& [key, chunk] : chunks) put(chunk, change_.chunks);
}

}  // namespace tessera
