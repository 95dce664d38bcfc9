// A store that outlives simulated coordinators, and remembers all that was ever written to it.
#pragma once

#include <absl/status/status.h>

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "coordinator/world_store.h"

namespace tessera {

// What is on it.
struct MemoryDisk {
  std::optional<StoredWorld> world;
  std::uint64_t since = 0;                    // the input that the state has, and those before
  std::uint64_t position = 0;                 // of the last input
  std::vector<v1::RecordedCommand> commands;  // all of them since the beginning
};

// Of one coordinator. A state that replaces another one is written after some calls of tend(); one that has
// not been when the coordinator ends is lost.
class MemoryStore final : public WorldStore {
 public:
  explicit MemoryStore(MemoryDisk& disk) : disk_(disk) {}

  std::optional<StoredWorld> take_stored() override { return disk_.world; }

  absl::Status begin(std::uint64_t load, const StoredState& state) override {
    pending_.reset();
    disk_.world = StoredWorld{load, state, {}};
    disk_.since = disk_.position;
    disk_.commands.clear();
    return absl::OkStatus();
  }
  absl::Status end() override {
    pending_.reset();
    disk_.world.reset();
    return absl::OkStatus();
  }

  absl::Status append(const std::vector<v1::StoredInput>& inputs) override {
    for (const v1::StoredInput& input : inputs) {
      ++disk_.position;
      if (disk_.world) disk_.world->inputs.push_back(input);
      if (input.has_command()) disk_.commands.push_back(input.command());
    }
    return absl::OkStatus();
  }
  std::uint64_t position() const override { return disk_.position; }

  bool replace(std::vector<v1::SnapshotChunk> snapshot, std::uint64_t position) override {
    if (pending_) return false;
    pending_ = Pending{std::move(snapshot), position, kCallsToWrite};
    return true;
  }
  absl::Status tend() override {
    if (!pending_ || --pending_->calls_left > 0) return absl::OkStatus();
    std::vector<v1::StoredInput>& inputs = disk_.world->inputs;
    inputs.erase(inputs.begin(),
                 inputs.begin() + static_cast<std::ptrdiff_t>(pending_->position - disk_.since));
    disk_.world->state = std::move(pending_->snapshot);
    disk_.since = pending_->position;
    pending_.reset();
    return absl::OkStatus();
  }

 private:
  static constexpr int kCallsToWrite = 5;

  struct Pending {
    std::vector<v1::SnapshotChunk> snapshot;
    std::uint64_t position = 0;
    int calls_left = 0;
  };

  MemoryDisk& disk_;
  std::optional<Pending> pending_;
};

}  // namespace tessera
