// The grants of a world on a sector server, in their order.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/status/status.h>

#include <cstdint>
#include <optional>

#include "cluster.pb.h"

namespace tessera {

// Each is carried out piece by piece: its map, then its ticks, then its questions.
class GrantQueue {
 public:
  explicit GrantQueue(std::uint64_t next_serial) : next_serial_(next_serial) {}

  // In any order. INVALID_ARGUMENT for one that was carried out already, or is too far ahead.
  absl::Status take(v1::Grant grant);

  // Whether one is being carried out, or can be.
  bool has_work() const { return grant_.has_value() || waiting_.contains(next_serial_); }

  // Begins the next one, of those that have work, unless one is being carried out: then null.
  v1::Grant* begin_next();

  // The next piece of the one that is being carried out, each once. First the map, if it has one.
  const v1::SectorMap* take_map();
  // Then a tick: the commands of the grant come with its first one. Null if none is left.
  struct GrantedTick {
    const std::string* commands = nullptr;  // packed; null: none
  };
  std::optional<GrantedTick> take_tick();
  // Then a question. The grant ends with the last one.
  std::optional<v1::Question> take_question();

  // What is left of it, at once.
  v1::Grant take_rest();

 private:
  absl::btree_map<std::uint64_t, v1::Grant> waiting_;  // by serial, from the next one on
  std::uint64_t next_serial_;
  std::optional<v1::Grant> grant_;  // being carried out
  bool has_map_ = false;            // that has not been taken
  std::uint64_t ticks_left_ = 0;
  int next_question_ = 0;
};

}  // namespace tessera
