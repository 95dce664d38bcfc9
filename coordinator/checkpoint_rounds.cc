#include "coordinator/checkpoint_rounds.h"

#include <utility>

namespace tessera {

void CheckpointRounds::tend(Nanoseconds now) {
  if (auto fresh = std::exchange(fresh_, std::nullopt)) {
    const KeptChunks& changes = kept_.add(fresh->tick, std::move(fresh->chunks), fresh->are_all, now);
    if (context_.journal.stores()) store(changes, fresh->position);
  } else {
    kept_.settle(now);
  }
  world_.sequencer.forget_past(kept_.earliest());
  world_.registry.shapes().drop_before(kept_.earliest());
  if (may_ask() && now >= next_) {
    next_ = now + context_.options.checkpoint_every;
    ask();
  }
}

std::optional<Nanoseconds> CheckpointRounds::next_deadline() const {
  return may_ask() ? std::optional(next_) : std::nullopt;
}

// Whether none is under way, and the world has gone on since the last.
bool CheckpointRounds::may_ask() const {
  return !world_.recovering() && !awaits_ && world_.sequencer.certain() > kept_.latest();
}

void CheckpointRounds::ask() {
  if (!world_.questions.room().ok()) return;
  awaits_ = true;
  const std::uint64_t left = world_.servers.left();
  Fresh next;
  next.tick = world_.sequencer.certain();
  next.are_all = told_among_ != left;
  if (context_.journal.stores()) {
    if (context_.journal.wants_whole()) unstored_.restart();
    unstored_.take_down(world_);
    next.position = context_.journal.position();
  }
  v1::SnapshotQuery query;
  query.set_keeps(true);
  query.set_anew(next.are_all);
  // The world calls this, so it exists, and this with it.
  world_.sequencer.ask_first(world_.questions.snapshot(
      query, [this, left, next = std::move(next)](const absl::Status& status,
                                                  std::vector<v1::SnapshotChunk> chunks) mutable {
        awaits_ = false;
        if (!status.ok()) return;
        told_among_ = left;
        next.chunks = std::move(chunks);
        fresh_ = std::move(next);
      }));
}

// `changes`: what it has of servers that is not in the checkpoint before it.
void CheckpointRounds::store(const KeptChunks& changes, std::uint64_t position) {
  unstored_.add(unstored_.change().is_whole ? kept_.latest_state() : changes);
  if (context_.journal.store_state(unstored_.change(), position)) unstored_.has_been_stored();
}

}  // namespace tessera
