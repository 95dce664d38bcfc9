// What makes a world outlive this process: inputs are on disk before anybody is told of them, and the
// coordinator that takes the place of this one goes on from the last state and the inputs since.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "coordinator/coordinator_impl.h"
#include "coordinator/limits.h"
#include "coordinator/recorded_commands.h"
#include "coordinator/unanswered.h"
#include "proto/convert.h"

namespace tessera {
namespace {

// Ticks that are stored as certain before they are granted: a coordinator that takes over does at most so
// many more than were done. At first those of half a second, of which half are done when the next ones are
// stored; of a world that is faster than real time so many that the store is not written much more often.
constexpr double kAheadSeconds = 0.5;
constexpr std::uint64_t kAheadAtFirstMax = 256;
constexpr std::uint64_t kAheadMax = 16'384;
constexpr std::chrono::milliseconds kPaceStoredEvery{250};

// What the client was told, or should have been.
std::string answer_to(const v1::RecordedCommand& command) {
  const auto with_id = [&](auto answer) {
    answer.set_id(command.id());
    answer.set_tick(command.tick());
    return answer.SerializeAsString();
  };
  if (command.has_spawn()) return with_id(v1::SpawnReply());
  if (command.has_add_joint()) return with_id(v1::AddJointReply());
  v1::CommandReply answer;
  answer.set_tick(command.tick());
  return answer.SerializeAsString();
}

bool is_same_pace(const v1::StoredPace& a, const v1::StoredPace& b) {
  return a.mode() == b.mode() && a.target() == b.target() && a.real_time_factor() == b.real_time_factor();
}

absl::StatusOr<WorldToLoad> world_from(const StoredState& state) {
  if (const auto* chunks = std::get_if<SnapshotChunks>(&state)) {
    absl::StatusOr<ReadSnapshot> snapshot = from_chunks(*chunks);
    if (!snapshot.ok()) return snapshot.status();
    return WorldToLoad{*std::move(snapshot)};
  }
  return described_world(std::get<v1::World>(state));
}

}  // namespace

// Writes what has come; what rests on it is told once it is stored. Where it cannot be written, it is tried
// again now and then; meanwhile the world waits or goes on, as configured.
void Coordinator::Impl::store_inputs(Nanoseconds now) {
  const bool has_commands = std::any_of(unstored_.begin(), unstored_.end(),
                                        [](const v1::StoredInput& input) { return input.has_command(); });
  std::uint64_t position = 0;
  if (stores()) {
    store_pace(now);
    if (store_.failure.empty() || now >= store_.next_try) write_inputs(now);
    if (store_.failure.empty() || waits_for_store())
      position = has_commands || !replies_.empty() ? stored_position() : rests_on();
  }
  if (!stores()) unstored_.clear();
  if (waits_for_store()) pass_by_held();
  if (!outbox_.empty() || !replies_.empty())
    held_back_.push_back({position, std::exchange(outbox_, {}), std::exchange(replies_, {})});
  release();
}

void Coordinator::Impl::write_inputs(Nanoseconds now) {
  if (!unstored_.empty()) {
    if (absl::Status status = options_.store->append(unstored_); !status.ok()) {
      return store_failed(status, now);
    }
    unstored_.clear();
  }
  if (!store_.failure.empty()) {
    store_.failure.clear();
    log("the store can be written again: nothing is missing in it", Severity::kWarning);
  }
  const absl::Status state = options_.store->tend();
  if (state.ok()) return;
  // The one before is still there, and the inputs since.
  store_.state_failure = std::string(state.message());
  log(absl::StrCat("a checkpoint could not be stored: ", store_.state_failure), Severity::kWarning);
}

// Only grants rest on what could not be stored; servers are not to wait for all the rest.
void Coordinator::Impl::pass_by_held() {
  const auto grants =
      std::stable_partition(outbox_.begin(), outbox_.end(),
                            [](const OutgoingMessage& message) { return !message.message.has_grant(); });
  std::move(outbox_.begin(), grants, std::back_inserter(released_));
  outbox_.erase(outbox_.begin(), grants);
}

// What waits for a store that cannot be written will never be stored: the world is gone, or this process
// ends.
void Coordinator::Impl::drop_unstored(const absl::Status& status) {
  unstored_.clear();
  if (std::exchange(store_.failure, "").empty()) return;
  for (const HeldBack& held : std::exchange(held_back_, {})) {
    for (const auto& reply : held.replies) reply(status);
  }
}

// As that of the sequencer; RESOURCE_EXHAUSTED while commands could not be stored, too.
absl::Status Coordinator::Impl::room_for_command(const Sequencer& sequencer, std::size_t shape_bytes) const {
  if (!waits_for_store()) return sequencer.room_for_command(shape_bytes);
  return absl::ResourceExhaustedError(
      absl::StrCat("the world waits, for its store cannot be written: ", store_.failure));
}

// The number of the input that makes certain what is granted so far; 0: that is stored.
std::uint64_t Coordinator::Impl::rests_on() const {
  const bool is_safe = !world_ || world_->loading() || world_->sequencer.certain() <= safe_tick_;
  return is_safe ? 0 : pace_position_;
}

void Coordinator::Impl::release() {
  const std::uint64_t stored =
      stores() ? options_.store->stored() : std::numeric_limits<std::uint64_t>::max();
  if (stored_pace_ && stored >= pace_position_) safe_tick_ = stored_pace_->certain();
  while (!held_back_.empty() && held_back_.front().position <= stored) {
    HeldBack told = std::move(held_back_.front());
    held_back_.pop_front();
    std::move(told.messages.begin(), told.messages.end(), std::back_inserter(released_));
    for (const auto& reply : told.replies) reply(absl::OkStatus());
  }
}

std::vector<OutgoingMessage> Coordinator::Impl::take_messages() {
  release();
  if (held_back_.empty()) {
    std::move(outbox_.begin(), outbox_.end(), std::back_inserter(released_));
    outbox_.clear();
  }
  return std::exchange(released_, {});
}

// Whether `next` says nothing that is not stored already, or will soon.
bool Coordinator::Impl::is_pace_stored(const v1::StoredPace& next) const {
  const v1::StoredPace& stored = *stored_pace_;
  if (next.mode() == v1::StoredPace::PAUSED) {
    // A step that is done pauses by itself.
    const bool pauses = stored.mode() != v1::StoredPace::RUNNING && stored.certain() >= stored.target();
    return pauses && next.certain() == stored.certain();
  }
  const Tick done = world_->sequencer.certain();
  return is_same_pace(next, stored) &&
         (done + pace_ahead_ / 2 <= stored.certain() || next.certain() == stored.certain());
}

// Early enough that grants need not wait until it is stored.
void Coordinator::Impl::store_pace(Nanoseconds now) {
  if (!world_ || world_->loading()) return;
  const Sequencer& sequencer = world_->sequencer;
  const double ticks = std::ceil(kAheadSeconds / world_->settings.time_step);
  const auto at_first = static_cast<std::uint64_t>(std::min<double>(ticks, kAheadAtFirstMax));
  pace_ahead_ = std::max(pace_ahead_, at_first);
  if (stored_pace_) {
    const v1::StoredPace pace = sequencer.stored_pace(pace_ahead_);
    if (is_pace_stored(pace)) return;
    if (!is_same_pace(pace, *stored_pace_)) {
      pace_ahead_ = at_first;
    } else if (now < pace_time_ + kPaceStoredEvery / 2) {
      pace_ahead_ = std::min(2 * pace_ahead_, kAheadMax);
    } else if (now > pace_time_ + 2 * kPaceStoredEvery) {
      pace_ahead_ = std::max(pace_ahead_ / 2, at_first);
    }
  }
  stored_pace_ = sequencer.stored_pace(pace_ahead_);
  *unstored_.emplace_back().mutable_pace() = *stored_pace_;
  pace_position_ = stored_position();
  pace_time_ = now;
}

absl::Status Coordinator::Impl::store_beginning(std::uint64_t load, const WorldToLoad& world) {
  if (options_.store == nullptr) return absl::OkStatus();
  const auto begin = [&] {
    if (const auto* described = std::get_if<WorldToLoad::Described>(&world.from)) {
      return options_.store->begin(load, to_proto(described->world));
    }
    const ReadSnapshot& snapshot = std::get<ReadSnapshot>(world.from);
    return options_.store->begin(load, chunks_of(snapshot.world, snapshot.catalogue));
  };
  if (absl::Status status = begin(); !status.ok()) return status;
  stored_pace_.reset();
  pace_ahead_ = 0;
  safe_tick_ = 0;
  drop_unstored(absl::FailedPreconditionError("the world was replaced before this was stored"));
  store_ = {};
  return absl::OkStatus();
}

// What the next checkpoint has that no server knows: names and properties, and what is held, as far as they
// are not what they were in the state that is stored.
void Coordinator::Impl::take_down_catalogue() {
  ActiveWorld& world = *world_;
  if (options_.store->wants_whole()) {
    world.unstored_state = {.is_whole = true, .chunks = {}};
    world.stored_head.restart();
    world.stored_catalogue.restart();
    world.stored_catalogue_changes.reset();
  }
  const auto take = [&](KeptChunk chunk) { put(std::move(chunk), world.unstored_state.chunks); };
  const WorldCatalogue brief = with_held(world, world.registry.next_ids());
  SnapshotChunks head = held_chunks(brief);
  head.push_back(head_chunk(brief, world.settings, world.anchor, world.sequencer.certain()));
  world.stored_head.compare(std::move(head), take);
  // Shapes leave some ticks after the change that takes their last body.
  const std::vector<ShapeEntry> shapes =
      with_held_shapes(brief, world.registry.shapes().at(world.sequencer.certain()));
  const std::pair changes(world.registry.changes(), shapes.size());
  if (world.stored_catalogue_changes == changes) return;
  world.stored_catalogue_changes = changes;
  world.stored_catalogue.compare(catalogue_chunks(world.registry.catalogue(), shapes), take);
}

// `changes`: what it has of servers that is not in the checkpoint before it.
void Coordinator::Impl::store_checkpoint(const KeptChunks& changes, std::uint64_t position) {
  StateChange& unstored = world_->unstored_state;
  for (const auto& [key, chunk] : unstored.is_whole ? world_->checkpoints->latest_state() : changes)
    put(chunk, unstored.chunks);
  // Inputs that it has may not be stored yet.
  if (!store_.failure.empty()) return;
  if (options_.store->wants_whole() && !unstored.is_whole) return;  // the next one will be
  if (!options_.store->change(unstored, position)) return;
  unstored = {};
  store_.state_failure.clear();
  stored_pace_.reset();  // it is stored anew, after the inputs that the snapshot has
}

absl::Status Coordinator::Impl::forget_stored() {
  if (options_.store == nullptr) return absl::OkStatus();
  stored_pace_.reset();
  drop_unstored(absl::FailedPreconditionError("the world ended before this was stored"));
  absl::Status status = options_.store->end();
  if (!status.ok()) {
    log(absl::StrCat(
            "the store still has the world, and a coordinator that is started anew would go on with it: ",
            status.message()),
        Severity::kError);
  }
  return status;
}

void Coordinator::Impl::store_failed(const absl::Status& status, Nanoseconds now) {
  store_.next_try = now + kStoreRetry;
  const bool is_new = store_.failure.empty();
  store_.failure = std::string(status.message());
  if (!options_.wait_for_store && unstored_.size() > kUnstoredMax) {
    store_.given_up = true;
    log(absl::StrCat("nothing is stored any more, and the world would not outlive this process: ",
                     store_.failure),
        Severity::kError);
  } else if (is_new) {
    log(absl::StrCat(
            options_.wait_for_store
                ? "the world waits, for its store cannot be written: "
                : "the world goes on, and would be set back if this process ended, for its store cannot "
                  "be written: ",
            store_.failure),
        Severity::kError);
  }
}

absl::Status Coordinator::Impl::resume_stored() {
  std::optional<StoredWorld> stored = stores() ? options_.store->take_stored() : std::nullopt;
  if (!stored) return absl::OkStatus();
  absl::StatusOr<WorldToLoad> world = world_from(stored->state);
  if (!world.ok()) return world.status();
  stored->state = {};
  loads_ = stored->load;
  const Tick tick = world->tick();
  world_ = make_world(std::make_shared<const WorldToLoad>(*std::move(world)), loads_, ++worlds_, {});
  v1::StoredPace pace;
  for (const v1::StoredInput& input : stored->inputs) {
    if (input.has_pace()) pace = input.pace();
    if (!input.has_command()) continue;
    absl::StatusOr<GivenCommand> given = given_again(input.command(), world_->registry);
    if (!given.ok()) {
      world_.reset();
      return absl::DataLossError(absl::StrCat("a stored command of tick ", input.command().tick(),
                                              " cannot be given again: ", given.status().message()));
    }
    sessions_.remember({input.session(), input.call()}, answer_to(input.command()));
    world_->sequencer.hold_at(input.command().tick(), std::move(given->command), std::move(given->new_shape));
  }
  world_->sequencer.restore_pace(pace);
  safe_tick_ = world_->sequencer.certain();
  log(absl::StrCat("the world '", world_->name, "' was stored at tick ", tick,
                   " and goes on once servers have joined"));
  return absl::OkStatus();
}

// Leaves the world, and the servers, to whoever takes over.
void Coordinator::Impl::retire() {
  if (finished_) return;
  if (!stores() || !world_) return shut_down("the coordinator was asked to end");
  log("leaving the world to the next coordinator");
  const absl::Status status = absl::UnavailableError("the coordinator is being replaced");
  world_->sequencer.tell_ticks();  // for they are stored, or will be, and take effect
  store_inputs(store_.next_try);
  if (waits_for_store()) drop_unstored(status);
  give_up_world(status);
  store_inputs(store_.next_try);
}

// Whoever leads now tells others what is true.
void Coordinator::Impl::abandon() {
  const absl::Status status = unanswered_error(
      "this coordinator does not lead any more: what it has not answered may have taken effect or not");
  give_up_world(status);
  for (HeldBack& held : std::exchange(held_back_, {})) {
    for (const auto& reply : held.replies) reply(status);
  }
  for (const auto& reply : std::exchange(replies_, {})) reply(status);
  outbox_.clear();
  released_.clear();
}

void Coordinator::Impl::give_up_world(const absl::Status& status) {
  give_up_waiting(status);
  for (const Drain& drain : std::exchange(drains_, {})) drain.reply(status, {});
  if (world_) {
    if (world_->load_reply) std::exchange(world_->load_reply, {})(status, {});
    world_->sequencer.abandon(status);
    world_->queries.abandon(status);
    world_.reset();
  }
  finished_ = true;
}

}  // namespace tessera
