// What makes a world outlive this process: inputs are on disk before anybody is told of them, and the
// coordinator that takes the place of this one goes on from the last state and the inputs since.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "coordinator/coordinator_impl.h"
#include "coordinator/recorded_commands.h"
#include "proto/convert.h"

namespace tessera {
namespace {

// Ticks that are stored as certain before they are granted: a coordinator that takes over repeats at most so
// much more than was done.
constexpr double kAheadSeconds = 0.5;
constexpr std::uint64_t kAheadTicksMax = 256;

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

absl::StatusOr<WorldToLoad> world_from(const StoredState& state) {
  if (const auto* chunks = std::get_if<SnapshotChunks>(&state)) {
    absl::StatusOr<ReadSnapshot> snapshot = from_chunks(*chunks);
    if (!snapshot.ok()) return snapshot.status();
    return WorldToLoad{*std::move(snapshot)};
  }
  return described_world(std::get<v1::World>(state));
}

}  // namespace

// Writes what has come; what rests on it is told once it is stored. Where that fails the world goes on, and
// what is stored stays as it is: the operator is told, in the log.
void Coordinator::Impl::store_inputs() {
  const bool has_commands = std::any_of(unstored_.begin(), unstored_.end(),
                                        [](const v1::StoredInput& input) { return input.has_command(); });
  std::uint64_t position = 0;
  if (stores()) {
    store_pace();
    absl::Status status = unstored_.empty() ? absl::OkStatus() : options_.store->append(unstored_);
    if (status.ok()) status = options_.store->tend();
    if (!status.ok()) store_failed(status);
    position = has_commands || !replies_.empty() ? options_.store->position() : rests_on();
  }
  unstored_.clear();
  if (!outbox_.empty() || !replies_.empty())
    held_back_.push_back({position, std::exchange(outbox_, {}), std::exchange(replies_, {})});
  release();
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

// Early enough that grants need not wait until it is stored.
void Coordinator::Impl::store_pace() {
  if (!world_ || world_->loading()) return;
  const Sequencer& sequencer = world_->sequencer;
  const double ticks = kAheadSeconds / world_->settings.time_step;
  const auto ahead = static_cast<std::uint64_t>(std::min<double>(std::ceil(ticks), kAheadTicksMax));
  v1::StoredPace pace = sequencer.stored_pace(ahead);
  if (stored_pace_) {
    const bool is_same = pace.mode() == stored_pace_->mode() && pace.target() == stored_pace_->target() &&
                         pace.real_time_factor() == stored_pace_->real_time_factor();
    const bool is_enough = pace.mode() == v1::StoredPace::PAUSED
                               ? pace.certain() == stored_pace_->certain()
                               : sequencer.certain() + ahead / 2 <= stored_pace_->certain() ||
                                     pace.certain() == stored_pace_->certain();
    if (is_same && is_enough) return;
  }
  *unstored_.emplace_back().mutable_pace() = pace;
  stored_pace_ = std::move(pace);
  pace_position_ = stored_position();
}

absl::Status Coordinator::Impl::store_beginning(std::uint64_t load, const WorldToLoad& world) {
  if (!stores()) return absl::OkStatus();
  stored_pace_.reset();
  safe_tick_ = 0;
  if (const auto* described = std::get_if<WorldToLoad::Described>(&world.from)) {
    return options_.store->begin(load, to_proto(described->world));
  }
  const ReadSnapshot& snapshot = std::get<ReadSnapshot>(world.from);
  return options_.store->begin(load, chunks_of(snapshot.world, snapshot.catalogue));
}

void Coordinator::Impl::store_checkpoint(SnapshotChunks snapshot, std::uint64_t position) {
  if (!stores() || !options_.store->replace(std::move(snapshot), position)) return;
  stored_pace_.reset();  // it is stored anew, after the inputs that the snapshot has
}

absl::Status Coordinator::Impl::forget_stored() {
  if (!stores()) return absl::OkStatus();
  unstored_.clear();
  stored_pace_.reset();
  absl::Status status = options_.store->end();
  if (!status.ok()) store_failed(status);
  return status;
}

void Coordinator::Impl::store_failed(const absl::Status& status) {
  store_failure_ = std::string(status.message());
  log(absl::StrCat("nothing is stored any more, and the world would not outlive this process: ",
                   store_failure_),
      Severity::kError);
}

absl::Status Coordinator::Impl::resume_stored() {
  std::optional<StoredWorld> stored = stores() ? options_.store->take_stored() : std::nullopt;
  if (!stored) return absl::OkStatus();
  absl::StatusOr<WorldToLoad> world = world_from(stored->state);
  if (!world.ok()) return world.status();
  stored->state = {};
  loads_ = stored->load;
  const Tick tick = world->tick();
  world_ = make_world(*std::move(world), loads_, ++worlds_, {});
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
  store_inputs();
  give_up_world(absl::UnavailableError("the coordinator is being replaced"));
  store_inputs();
}

// Whoever leads now tells others what is true.
void Coordinator::Impl::abandon() {
  const absl::Status status = absl::UnavailableError(
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
