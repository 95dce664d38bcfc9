// The production store on a simulated disk, and a record of all that was ever written to it.
#pragma once

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "coordinator/world_store.h"

namespace tessera {

// The inputs of one world since it was loaded, as far as they are stored. Outlives stores.
class StoreHistory {
 public:
  void begin(std::uint64_t position) {
    before_ = sure_ = position;
    has_world_ = true;
    goes_on();
    inputs_.clear();
  }
  void end() { has_world_ = is_ending_ = false; }
  // The process may end before it is told that one of these has happened.
  void may_begin(std::uint64_t load) { beginning_ = load; }
  void may_end() { is_ending_ = true; }
  // It has not.
  void goes_on() {
    beginning_.reset();
    is_ending_ = false;
  }

  // Whether these are stored is known once the store is opened again, or was told.
  void write(std::uint64_t position, const std::vector<v1::StoredInput>& inputs) {
    goes_on();
    inputs_.resize(position - before_);
    inputs_.insert(inputs_.end(), inputs.begin(), inputs.end());
  }
  void written(std::uint64_t position) { sure_ = position; }

  // A store was opened, up to `position`. ABORTED where it is not what was written.
  absl::Status opened(const std::optional<StoredWorld>& world, std::uint64_t position) {
    const bool has_begun = world && beginning_ == world->load;
    const bool has_ended = !world && is_ending_;
    goes_on();
    if (has_begun) begin(position - world->inputs.size());
    if (has_ended) end();
    if (!has_world_) return absl::OkStatus();
    if (!world) return absl::AbortedError("the store has lost its world");
    if (position < sure_) {
      return absl::AbortedError(
          absl::StrCat("the store has ", position, " inputs, and ", sure_, " were stored"));
    }
    if (position > before_ + inputs_.size()) return absl::AbortedError("the store has inputs of its own");
    inputs_.resize(position - before_);
    sure_ = position;
    if (world->inputs.size() > inputs_.size()) return absl::AbortedError("the store has inputs twice");
    for (std::size_t n = 1; n <= world->inputs.size(); ++n) {
      const std::string stored = world->inputs[world->inputs.size() - n].SerializeAsString();
      if (stored != inputs_[inputs_.size() - n].SerializeAsString()) {
        return absl::AbortedError(absl::StrCat("input ", position - n + 1, " is not as it was stored"));
      }
    }
    return absl::OkStatus();
  }

  std::vector<v1::StoredInput> commands() const {
    std::vector<v1::StoredInput> commands;
    for (const v1::StoredInput& input : inputs_) {
      if (!input.commands().commands().empty()) commands.push_back(input);
    }
    return commands;
  }

 private:
  bool has_world_ = false;
  std::optional<std::uint64_t> beginning_;  // its load
  bool is_ending_ = false;
  std::uint64_t before_ = 0;  // inputs of earlier worlds
  std::uint64_t sure_ = 0;
  std::vector<v1::StoredInput> inputs_;
};

class WatchedStore final : public WorldStore {
 public:
  WatchedStore(std::unique_ptr<WorldStore> store, StoreHistory& history)
      : store_(std::move(store)), history_(history) {}

  // What was found, compared with what was written; the first of all calls.
  absl::Status compare() {
    found_ = store_->take_stored();
    return history_.opened(found_, store_->position());
  }

  std::optional<StoredWorld> take_stored() override { return std::exchange(found_, std::nullopt); }

  absl::Status begin(std::uint64_t load, const StoredState& state) override {
    history_.may_begin(load);
    absl::Status status = store_->begin(load, state);
    if (status.ok()) history_.begin(store_->position());
    return status;
  }
  absl::Status end() override {
    history_.may_end();
    absl::Status status = store_->end();
    if (status.ok()) history_.end();
    return status;
  }
  absl::StatusOr<std::string> set_aside(const std::string& reason) override {
    absl::StatusOr<std::string> where = store_->set_aside(reason);
    if (where.ok()) history_.end();
    return where;
  }
  absl::Status append(const std::vector<v1::StoredInput>& inputs) override {
    history_.write(store_->position(), inputs);
    absl::Status status = store_->append(inputs);
    if (status.ok()) history_.written(store_->position());
    return status;
  }
  std::uint64_t position() const override { return store_->position(); }
  std::uint64_t stored() const override { return store_->stored(); }
  bool wants_whole() const override { return store_->wants_whole(); }
  bool change(StateChange change, std::uint64_t position) override {
    return store_->change(std::move(change), position);
  }
  absl::Status tend() override { return store_->tend(); }

 private:
  std::unique_ptr<WorldStore> store_;
  StoreHistory& history_;
  std::optional<StoredWorld> found_;
};

}  // namespace tessera
