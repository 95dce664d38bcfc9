// What leads from the state of a world that is stored to its next checkpoint.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "coordinator/active_world.h"
#include "coordinator/world_store.h"
#include "proto/kept_chunks.h"

namespace tessera {

class UnstoredState {
 public:
  // Nothing is stored that it could be added to.
  void restart();

  // Takes down, as of the tick that is certain now, what no server knows and what is not stored so already:
  // what is held, and names and properties.
  void take_down(const ActiveWorld& world);

  // Adds chunks of servers.
  void add(const KeptChunks& chunks);

  const StateChange& change() const { return change_; }
  void has_been_stored() { change_ = {}; }

 private:
  StateChange change_;
  ChunkChanges head_;       // of the state that is stored, with what is held
  ChunkChanges catalogue_;  // likewise, of names and properties
  // As of the registry, and the number of shapes.
  std::optional<std::pair<std::uint64_t, std::size_t>> catalogue_changes_;
};

}  // namespace tessera
