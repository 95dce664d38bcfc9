// Compares what a cluster computed with the same world in one process.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "lpss/model/world_description.h"
#include "lpss/simulation/simulation.h"
#include "recording.pb.h"

namespace tessera {

class Checker {
 public:
  explicit Checker(const WorldDescription& world) : world_(world) {}

  // Called after each tick from now on: true ends the running check with CANCELLED.
  void end_when(std::function<bool()> is_ended) { is_ended_ = std::move(is_ended); }

  // The hash after `tick` ticks without commands. Computed once for each tick.
  absl::StatusOr<std::string> untouched_hash(Tick tick);

  // Plays the commands of a log. ABORTED, with the tick, if a hash differs from that of the log, or a command
  // is refused or has a different result.
  absl::Status check(std::span<const v1::RecordedInput> log);

 private:
  WorldDescription world_;
  std::unique_ptr<Simulation> untouched_;
  absl::flat_hash_map<Tick, std::string> untouched_hashes_;
  std::function<bool()> is_ended_ = [] { return false; };
};

}  // namespace tessera
