#include "coordinator/journal.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <iterator>
#include <limits>

#include "coordinator/limits.h"
#include "lpss/base/invariant.h"
#include "proto/convert.h"

namespace tessera {

void Journal::add(v1::RecordedCommands commands, RequestId request) {
  if (!stores()) return;
  v1::StoredInput& input = unstored_.emplace_back();
  input.set_session(request.session);
  input.set_number(request.number);
  *input.mutable_commands() = std::move(commands);
}

void Journal::keep(RequestId request, const v1::Applied& applied) {
  if (!stores()) return;
  v1::StoredInput& input = unstored_.emplace_back();
  input.set_session(request.session);
  input.set_number(request.number);
  *input.mutable_carried_out() = applied;
}

void Journal::flush(const Sequencer* running, Nanoseconds now) {
  const bool has_commands = std::any_of(unstored_.begin(), unstored_.end(),
                                        [](const v1::StoredInput& input) { return input.has_commands(); });
  std::uint64_t rests_on = 0;  // the number of an input
  if (stores()) {
    if (std::optional<v1::StoredPace> pace = running ? pace_.next(*running, now) : std::nullopt) {
      *unstored_.emplace_back().mutable_pace() = *std::move(pace);
      pace_.added_as(position());
    }
    if (failure_.empty() || now >= next_try_) write(now);
    if (failure_.empty() || waits()) {
      const bool rests_on_all = has_commands || !replies_.empty();
      rests_on = rests_on_all ? position() : running ? pace_.basis_of(*running) : 0;
    }
  }
  if (!stores()) unstored_.clear();
  if (waits()) pass_by_held();
  if (!outbox_.empty() || !replies_.empty())
    held_back_.push_back({rests_on, std::exchange(outbox_, {}), std::exchange(replies_, {})});
  release();
}

void Journal::write(Nanoseconds now) {
  if (!unstored_.empty()) {
    const std::uint64_t after = position();
    if (absl::Status status = store_->append(unstored_); !status.ok()) return failed(status, now);
    unstored_.clear();
    invariant(store_->position() == after, "a store counts the inputs that it is given");
  }
  if (!failure_.empty()) {
    failure_.clear();
    log_("the store can be written again: nothing is missing in it", Severity::kWarning);
  }
  const absl::Status state = store_->tend();
  if (state.ok()) return;
  // The one before is still there, and the inputs since.
  state_failure_ = std::string(state.message());
  log_(absl::StrCat("a checkpoint could not be stored: ", state_failure_), Severity::kWarning);
}

void Journal::failed(const absl::Status& status, Nanoseconds now) {
  next_try_ = now + kStoreRetry;
  const bool is_new = failure_.empty();
  failure_ = std::string(status.message());
  if (!may_wait_ && unstored_.size() > kUnstoredMax) {
    given_up_ = true;
    log_(absl::StrCat("nothing is stored any more, and the world would not outlive this process: ", failure_),
         Severity::kError);
  } else if (is_new) {
    log_(absl::StrCat(may_wait_
                          ? "the world waits, for its store cannot be written: "
                          : "the world goes on, and would be set back if this process ended, for its store "
                            "cannot be written: ",
                      failure_),
         Severity::kError);
  }
}

// Only grants rest on what could not be stored; servers are not to wait for all the rest.
void Journal::pass_by_held() {
  const auto grants =
      std::stable_partition(outbox_.begin(), outbox_.end(),
                            [](const OutgoingMessage& message) { return !message.message.has_grant(); });
  std::move(outbox_.begin(), grants, std::back_inserter(released_));
  outbox_.erase(outbox_.begin(), grants);
}

void Journal::release() {
  const std::uint64_t stored = stores() ? store_->stored() : std::numeric_limits<std::uint64_t>::max();
  invariant(!stores() || stored <= store_->position(), "no input is stored before it is written");
  pace_.stored(stored);
  while (!held_back_.empty() && held_back_.front().position <= stored) {
    HeldBack told = std::move(held_back_.front());
    held_back_.pop_front();
    std::move(told.messages.begin(), told.messages.end(), std::back_inserter(released_));
    for (const StoredReply& reply : told.replies) reply(absl::OkStatus());
  }
}

std::vector<OutgoingMessage> Journal::take_messages() {
  release();
  if (held_back_.empty()) {
    std::move(outbox_.begin(), outbox_.end(), std::back_inserter(released_));
    outbox_.clear();
  }
  return std::exchange(released_, {});
}

absl::Status Journal::room() const {
  if (!waits()) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat("the world waits, for its store cannot be written: ", failure_));
}

std::optional<Nanoseconds> Journal::next_try() const {
  return stores() && !failure_.empty() ? std::optional(next_try_) : std::nullopt;
}

absl::Status Journal::begin(std::uint64_t load, const WorldToLoad& world) {
  if (store_ == nullptr) return absl::OkStatus();
  const auto begin = [&] {
    if (const auto* described = std::get_if<WorldToLoad::Described>(&world.from))
      return store_->begin(load, to_proto(described->world));
    const ReadSnapshot& snapshot = std::get<ReadSnapshot>(world.from);
    return store_->begin(load, chunks_of(snapshot.world, snapshot.catalogue));
  };
  if (absl::Status status = begin(); !status.ok()) return status;
  drop_unstored(absl::FailedPreconditionError("the world was replaced before this was stored"));
  pace_ = {};
  dropped_ = true;
  next_try_ = {};
  given_up_ = false;
  state_failure_.clear();
  return absl::OkStatus();
}

template <typename End>
absl::Status Journal::ended(const End& end) {
  if (store_ == nullptr) return absl::OkStatus();
  pace_.renew();
  drop_unstored(absl::FailedPreconditionError("the world ended before this was stored"));
  absl::Status status = end();
  if (!status.ok()) {
    log_(absl::StrCat(
             "the store still has the world, and a coordinator that is started anew would go on with it: ",
             status.message()),
         Severity::kError);
  }
  return status;
}

absl::Status Journal::end() {
  return ended([this] { return store_->end(); });
}

absl::StatusOr<std::string> Journal::set_aside(const std::string& reason) {
  absl::StatusOr<std::string> where = std::string();
  absl::Status status = ended([&] {
    where = store_->set_aside(reason);
    return where.status();
  });
  if (!status.ok()) return status;
  return where;
}

absl::StatusOr<StoredWorld> Journal::leave_out(Tick tick, Nanoseconds now) {
  if (!stores()) return absl::UnavailableError("the world is not stored");
  unstored_.emplace_back().set_left_out(tick);
  write(now);
  if (!failure_.empty()) return absl::UnavailableError(failure_);
  return store_->read_again();
}

bool Journal::store_state(const StateChange& state, std::uint64_t position) {
  // Inputs that it has may not be stored yet.
  if (!stores() || !failure_.empty()) return false;
  if (store_->wants_whole() && !state.is_whole) return false;  // the next one will be
  invariant(position <= store_->position(), "the inputs of a state are written before it");
  if (!store_->change(state, position)) return false;
  state_failure_.clear();
  dropped_ = true;
  pace_.renew();
  return true;
}

void Journal::drop_unstored(const absl::Status& status) {
  unstored_.clear();
  if (std::exchange(failure_, "").empty()) return;
  for (const HeldBack& held : std::exchange(held_back_, {})) {
    for (const StoredReply& reply : held.replies) reply(status);
  }
}

void Journal::abandon(const absl::Status& status) {
  for (HeldBack& held : std::exchange(held_back_, {})) {
    for (const StoredReply& reply : held.replies) reply(status);
  }
  for (const StoredReply& reply : std::exchange(replies_, {})) reply(status);
  outbox_.clear();
  released_.clear();
}

}  // namespace tessera
