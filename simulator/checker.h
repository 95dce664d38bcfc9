// Compares what a cluster computed with the same world in one process.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/container/flat_hash_map.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "coordinator/coordinator.h"
#include "lpss/model/world_description.h"
#include "lpss/simulation/simulation.h"
#include "recording.pb.h"

namespace tessera {

// After a tick.
struct TickHashes {
  std::string world;
  std::string programs;  // empty: there are none
  friend bool operator==(const TickHashes&, const TickHashes&) = default;
};

TickHashes hashes_of(const Simulation& simulation);

class Checker {
 public:
  explicit Checker(const WorldDescription& world) : world_(world) {}

  // Called after each tick from now on: true ends the running check with CANCELLED.
  void end_when(std::function<bool()> is_ended) { is_ended_ = std::move(is_ended); }

  // The hash after `tick` ticks without commands. Computed once for each tick.
  absl::StatusOr<std::string> untouched_hash(Tick tick);

  // Plays the commands of a log, in the world as described, or from a snapshot. ABORTED, with the tick, if a
  // hash differs from that of the log, a command is refused or has a different result, or a tick takes more
  // processor time than it may.
  absl::Status check(std::span<const v1::RecordedInput> log, const SnapshotChunks* from = nullptr);

  // From now on; 0: without a bound.
  void set_tick_work_max(std::chrono::nanoseconds most) { tick_work_max_ = most; }
  // The longest tick so far that was played with commands.
  std::chrono::nanoseconds longest_tick() const { return longest_tick_; }

 private:
  absl::StatusOr<TickHashes> untouched(Tick tick);
  absl::Status play(std::span<const v1::RecordedInput> log, const absl::btree_map<Tick, TickHashes>& hashes,
                    const SnapshotChunks* from);

  WorldDescription world_;
  std::chrono::nanoseconds tick_work_max_{0};
  std::chrono::nanoseconds longest_tick_{0};
  std::unique_ptr<Simulation> untouched_;
  absl::flat_hash_map<Tick, TickHashes> untouched_hashes_;
  std::function<bool()> is_ended_ = [] { return false; };
};

}  // namespace tessera
