// Checkpoints of a running world: asked for again and again, kept, and stored.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "coordinator/active_world.h"
#include "coordinator/checkpoints.h"
#include "coordinator/context.h"
#include "coordinator/unstored_state.h"

namespace tessera {

class CheckpointRounds {
 public:
  // `start`: what servers are sent at first. Both must outlive this.
  CheckpointRounds(const CoordinatorContext& context, ActiveWorld& world,
                   std::shared_ptr<const WorldToLoad> start)
      : context_(context), world_(world), kept_(std::move(start)) {}
  CheckpointRounds(const CheckpointRounds&) = delete;
  CheckpointRounds& operator=(const CheckpointRounds&) = delete;

  const Checkpoints& kept() const { return kept_; }

  // Keeps what has come, forgets what nobody goes back to any more, and asks for the next one when it is due.
  void tend(Nanoseconds now);
  std::optional<Nanoseconds> next_deadline() const;

  // The world goes back to one: none of its servers knows what the last one had.
  void set_back() { told_among_.reset(); }

 private:
  // One that has just come from the servers.
  struct Fresh {
    Tick tick = 0;
    bool are_all = false;        // the chunks; otherwise those that have changed since the one before
    std::uint64_t position = 0;  // of the inputs that it has
    std::vector<v1::SnapshotChunk> chunks;
  };

  bool may_ask() const;
  void ask();
  void store(const KeptChunks& changes, std::uint64_t position);

  const CoordinatorContext& context_;
  ActiveWorld& world_;
  Checkpoints kept_;
  UnstoredState unstored_;
  std::optional<Fresh> fresh_;
  bool awaits_ = false;  // one from the servers
  Nanoseconds next_{};   // the time
  // So many servers had left when all that there were told of the last one. If others have left since,
  // nobody tells what has become of their sectors, unless all tell everything.
  std::optional<std::uint64_t> told_among_;
};

}  // namespace tessera
