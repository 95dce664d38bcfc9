// What must be stored before anybody is told of it, and the messages and answers that wait for that.
#pragma once

#include <absl/status/status.h>

#include <chrono>
#include <concepts>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/coordinator.h"
#include "coordinator/event_log.h"
#include "coordinator/pace_log.h"
#include "coordinator/recording.h"
#include "coordinator/sequencer.h"
#include "coordinator/world_store.h"
#include "coordinator/world_to_load.h"
#include "transport/link.h"

namespace tessera {

// Answers that are not given before what they rest on is on disk.
template <typename Answer>
concept RestsOnStore = std::same_as<Answer, v1::Reply> || std::same_as<Answer, v1::PauseReply> ||
    std::same_as<Answer, v1::ResumeReply>;

// Inputs are on disk before anybody is told of them, so that the coordinator that takes the place of this one
// goes on from the last state and the inputs since. Without a store, all passes at once.
class Journal {
 public:
  // `store` may be null. `may_wait`: the world waits while the store cannot be written; otherwise it goes on,
  // and what comes meanwhile is stored once that is possible.
  Journal(WorldStore* store, bool may_wait, const EventLog& log)
      : store_(store), may_wait_(may_wait), log_(log) {}

  // A message for the caller to fill. It leaves once all inputs so far are stored.
  v1::ClusterMessage& send(NodeId to) { return outbox_.emplace_back(OutgoingMessage{to, {}}).message; }

  // Likewise with the answer to a call, if it rests on an input; errors rest on nothing.
  template <typename Request, typename Answer>
  void answer_once_stored(ClientCall<Request, Answer>& call);

  // Commands of a client's request, and none where it only runs ticks.
  void add(v1::RecordedCommands commands, RequestId request);
  // What a request did that the client may make again, where the store has dropped its commands since the
  // last call of take_dropped().
  void keep(RequestId request, const v1::Applied& applied);
  bool take_dropped() { return std::exchange(dropped_, false); }

  // Writes what has come, with the pace of the world that runs, if one does, and answers what rested on it.
  // Where it cannot be written, that is tried again now and then.
  void flush(const Sequencer* running, Nanoseconds now);
  // Likewise, without waiting for the next try.
  void flush_at_once(const Sequencer* running) { flush(running, next_try_); }

  // What may leave. May also answer calls that waited.
  std::vector<OutgoingMessage> take_messages();
  bool holds_back() const { return !held_back_.empty(); }

  bool stores() const { return store_ != nullptr && !given_up_; }
  // Whether the world has to wait: the store cannot be written.
  bool waits() const { return stores() && may_wait_ && !failure_.empty(); }
  // RESOURCE_EXHAUSTED then.
  absl::Status room() const;
  std::optional<Nanoseconds> next_try() const;
  // What the store, or the last checkpoint, suffers from; empty while all is well.
  const std::string& failure() const { return failure_.empty() ? state_failure_ : failure_; }

  // A world begins, in the place of another; on return it is stored. Errors are the store's; then nothing has
  // changed.
  absl::Status begin(std::uint64_t load, const WorldToLoad& world);
  // There is no world any more. Errors, which are logged, are the store's.
  absl::Status end();
  // Likewise, and what is stored of it is kept elsewhere: WorldStore::set_aside().
  absl::StatusOr<std::string> set_aside(const std::string& reason);

  // The world goes on without the commands of that tick. What is stored then; errors are the store's, and
  // UNAVAILABLE without one.
  absl::StatusOr<StoredWorld> leave_out(Tick tick, Nanoseconds now);

  // What was stored before this process began; once. It is certain to run up to the tick that goes to
  // resume().
  std::optional<StoredWorld> take_stored() { return stores() ? store_->take_stored() : std::nullopt; }
  void resume(Tick certain) { pace_.resume(certain); }

  // The number of inputs so far.
  std::uint64_t position() const { return store_->position() + unstored_.size(); }
  // Whether the store needs a whole state next; otherwise, what has changed.
  bool wants_whole() const { return store_->wants_whole(); }
  // The state after the inputs up to `position`. False, and nothing happens, where it cannot be stored now.
  bool store_state(const StateChange& state, std::uint64_t position);

  // What could not be stored will never be: calls that wait for it get `status`.
  void drop_unstored(const absl::Status& status);
  // Another process leads: nothing leaves any more, and all calls that wait get `status`.
  void abandon(const absl::Status& status);

 private:
  using StoredReply = std::function<void(const absl::Status& stored)>;

  // What is told only once the inputs up to `position` are stored.
  struct HeldBack {
    std::uint64_t position = 0;
    std::vector<OutgoingMessage> messages;
    std::vector<StoredReply> replies;
  };

  template <typename End>
  absl::Status ended(const End& end);
  void write(Nanoseconds now);
  void failed(const absl::Status& status, Nanoseconds now);
  void pass_by_held();
  void release();

  WorldStore* const store_;
  const bool may_wait_;
  const EventLog& log_;
  PaceLog pace_;
  std::vector<v1::StoredInput> unstored_;
  std::vector<OutgoingMessage> outbox_;  // since the last flush()
  std::vector<StoredReply> replies_;     // likewise
  std::deque<HeldBack> held_back_;
  std::vector<OutgoingMessage> released_;
  bool dropped_ = false;  // inputs, of which a state has taken the place
  std::string failure_;   // of the store; empty while it can be written
  Nanoseconds next_try_{};
  bool given_up_ = false;      // too much came meanwhile
  std::string state_failure_;  // why the last checkpoint is not there; empty if it is
};

template <typename Request, typename Answer>
void Journal::answer_once_stored(ClientCall<Request, Answer>& call) {
  if constexpr (RestsOnStore<Answer>) {
    if (!stores()) return;
    call.reply = [this, reply = std::move(call.reply)](const absl::Status& status, const Answer& answer) {
      if (!status.ok()) return reply(status, answer);
      replies_.push_back([reply, status, answer](const absl::Status& stored) {
        reply(stored.ok() ? status : stored, stored.ok() ? answer : Answer());
      });
    };
  }
}

}  // namespace tessera
