// The states to which a running world can be set back when a server is lost.
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "coordinator/placement.h"
#include "lpss/tick/messages.h"
#include "proto/kept_chunks.h"

namespace tessera {

// What the servers of a world had at the end of a tick: all of it, or what had changed.
struct Checkpoint {
  Tick tick = 0;
  KeptChunks chunks;
};

class Checkpoints {
 public:
  using Nanoseconds = std::chrono::nanoseconds;

  // `start` is what the servers are sent at first.
  explicit Checkpoints(std::shared_ptr<const WorldToLoad> start) : start_(std::move(start)) {}

  // Adds a later one: `chunks` are all that servers have, or what has changed since the latest. Returns the
  // latter; valid until the next call. Earlier ones stay until this one is kStreamSlack old: what servers had
  // yet to send to clients when one of them was lost comes again only from ticks after the state that all go
  // back to.
  const KeptChunks& add(Tick tick, std::vector<v1::SnapshotChunk> chunks, bool are_all, Nanoseconds now);

  // Drops those that are not needed any more.
  void settle(Nanoseconds now);

  // The tick that the world would be set back to, and that of the latest checkpoint.
  Tick earliest() const { return start_ ? start_->tick() : earliest_.tick; }
  Tick latest() const { return later_.empty() ? earliest() : later_.back().changes.tick; }

  // All chunks of the latest; none while there is only what the servers were sent at first.
  KeptChunks latest_state() const;

  // What the servers `hosts` are sent to go on from earliest(). `shapes` are those of that tick. DATA_LOSS
  // where a server sent what cannot be read, otherwise errors as place().
  absl::StatusOr<Placement> place_earliest(std::uint64_t number, const WorldSettings& settings,
                                           const SectorIndex& anchor, std::vector<ShapeEntry> shapes,
                                           std::span<const Host> hosts, std::uint64_t map_epoch,
                                           BalancePolicy policy) const;

  // What a server is sent that is to take part, as of latest(). `shapes` are those of that tick.
  v1::LoadWorld guest_load(std::uint64_t number, const WorldSettings& settings, const SectorIndex& anchor,
                           std::vector<ShapeEntry> shapes, std::span<const NodeId> nodes,
                           const SectorMap& map) const;

 private:
  struct Later {
    Checkpoint changes;  // since the one before
    Nanoseconds time{};
  };

  std::shared_ptr<const WorldToLoad> start_;  // null once there is a later one instead
  Checkpoint earliest_;                       // of no meaning until then
  std::deque<Later> later_;                   // ascending
};

// How far behind the servers a client may be that misses no tick of a stream when one of them is lost.
inline constexpr std::chrono::milliseconds kStreamSlack{500};

}  // namespace tessera
