#include "coordinator/world_slot.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "coordinator/command_list.h"
#include "coordinator/limits.h"
#include "coordinator/placement.h"
#include "proto/convert.h"
#include "proto/convert_counts.h"

namespace tessera {
namespace {

absl::StatusOr<WorldToLoad> restored_world(const SnapshotChunks& chunks) {
  absl::StatusOr<ReadSnapshot> snapshot = from_chunks(chunks);
  if (!snapshot.ok()) return snapshot.status();
  return WorldToLoad{*std::move(snapshot)};
}

absl::StatusOr<WorldToLoad> world_from(const StoredState& state) {
  if (const auto* chunks = std::get_if<SnapshotChunks>(&state)) return restored_world(*chunks);
  return described_world(std::get<v1::World>(state));
}

}  // namespace

absl::StatusOr<HostedWorld*> WorldSlot::live() {
  if (hosted_ && !hosted_->loading()) return hosted_.get();
  if (hosted_ || waiting_) return absl::FailedPreconditionError("the world is being loaded");
  if (failed_) return absl::UnavailableError(failed_->failure());
  return absl::FailedPreconditionError("no world is loaded");
}

absl::Status WorldSlot::may_load(bool replace) const {
  if (waiting_ || (hosted_ && hosted_->loading()))
    return absl::FailedPreconditionError("another world is being loaded");
  if (hosted_ && !replace) {
    return absl::AlreadyExistsError(
        absl::StrCat("the world '", hosted_->world().name, "' is loaded; set `replace` to replace it"));
  }
  return absl::OkStatus();
}

void WorldSlot::load(ClientCall<v1::LoadRequest, v1::LoadReply>& call, Nanoseconds now) {
  if (absl::Status status = may_load(call.request.replace()); !status.ok()) return call.reply(status, {});
  if (!call.request.has_world()) return call.reply(absl::InvalidArgumentError("world must be set"), {});
  absl::StatusOr<WorldToLoad> world = described_world(call.request.world());
  if (!world.ok()) return call.reply(world.status(), {});
  call.request = {};  // the description has everything, and the request may be large
  waiting_ = WaitingLoad{std::move(call.reply), *std::move(world), now + context_.options.join_timeout};
  try_start();
}

void WorldSlot::load(ClientCall<RestoreChunks, v1::LoadReply>& call, Nanoseconds now) {
  if (absl::Status status = may_load(call.request.replace); !status.ok()) return call.reply(status, {});
  absl::StatusOr<WorldToLoad> world = restored_world(call.request.chunks);
  if (!world.ok()) return call.reply(world.status(), {});
  call.request = {};
  waiting_ = WaitingLoad{std::move(call.reply), *std::move(world), now + context_.options.join_timeout};
  try_start();
}

std::string WorldSlot::missing_servers(const WaitingLoad& load) const {
  const Precision precision = load.world.settings().precision;
  return absl::StrCat("the world '", load.world.name(), "' needs ", context_.choice.servers_min(),
                      " servers of ", context_.choice.described(precision), ", but there are ",
                      context_.choice.fit(precision).size(), " after waiting for ",
                      std::chrono::duration<double>(context_.options.join_timeout).count(), " s");
}

void WorldSlot::try_start() {
  if (!waiting_) return;
  const std::vector<NodeId> nodes = context_.choice.chosen(waiting_->world.settings().precision);
  if (nodes.size() < context_.choice.servers_min()) return;
  start(*std::exchange(waiting_, std::nullopt), context_.choice.ranked(nodes));
}

void WorldSlot::start(WaitingLoad load, const std::vector<NodeId>& nodes) {
  absl::StatusOr<Placement> placement =
      place(context_.numbers.next(), load.world, context_.choice.hosts(nodes), /*map_epoch=*/1,
            context_.options.balance_policy);
  if (!placement.ok()) return load.reply(placement.status(), {});
  if (absl::Status status = context_.journal.begin(loads_ + 1, load.world); !status.ok())
    return load.reply(status, {});
  const bool replaces = hosted_ != nullptr;
  end_hosted(absl::FailedPreconditionError("the world was replaced by another"), nodes);
  failed_.reset();
  hosted_ =
      std::make_unique<HostedWorld>(context_, std::make_shared<const WorldToLoad>(std::move(load.world)),
                                    ++loads_, context_.numbers.take_next(), nodes);
  hosted_->load(*std::move(placement), {std::move(load.reply), replaces});
  const ActiveWorld& world = hosted_->world();
  context_.log(absl::StrCat("loading the world '", world.name, "': ", world.registry.body_count(),
                            " bodies on ", nodes.size(), " servers"));
}

void WorldSlot::end_waiting(const absl::Status& status) {
  if (!waiting_) return;
  const WaitingLoad load = *std::exchange(waiting_, std::nullopt);
  context_.log(std::string(status.message()), Severity::kWarning);
  load.reply(status, {});
}

// Servers that are `staying` for the next world need no message: a load replaces their world.
void WorldSlot::end_hosted(const absl::Status& status, const std::vector<NodeId>& staying) {
  if (!hosted_) return;
  const std::unique_ptr<HostedWorld> ended = std::move(hosted_);
  ended->abandon(status);
  for (const NodeId node : ended->world().servers.listeners()) {
    if (std::find(staying.begin(), staying.end(), node) != staying.end()) continue;
    if (context_.members.find(node) != nullptr)
      context_.journal.send(node).mutable_unload_world()->set_world(ended->world().number);
  }
}

void WorldSlot::close(const absl::Status& status) {
  end_waiting(status);
  end_hosted(status, {});
}

void WorldSlot::abandon(const absl::Status& status) {
  end_waiting(status);
  if (const std::unique_ptr<HostedWorld> left = std::move(hosted_)) left->abandon(status);
}

// A load that fails before the world exists leaves no world; any other failure leaves a failed world.
void WorldSlot::check(const absl::Status& status, Nanoseconds now) {
  if (status.ok()) return;
  const ActiveWorld& world = hosted_->world();
  const bool leaves_trace = !world.loading() || world.being_loaded->replaces_another;
  if (leaves_trace) {
    v1::StatusReply last = this->status(now);
    last.set_state("failed");
    last.set_failure(std::string(status.message()));
    failed_ = std::move(last);
  }
  context_.log(absl::StrCat("the world '", world.name, "' has failed: ", status.message()), Severity::kError);
  context_.journal.end().IgnoreError();  // which is logged
  end_hosted(status, {});
}

void WorldSlot::unload(ClientCall<v1::UnloadRequest, v1::UnloadReply>& call) {
  if (!hosted_ && !waiting_ && !failed_)
    return call.reply(absl::FailedPreconditionError("no world is loaded"), {});
  const absl::Status status = absl::FailedPreconditionError("the world was unloaded");
  end_waiting(status);
  if (hosted_) context_.log(absl::StrCat("the world '", hosted_->world().name, "' is unloaded"));
  end_hosted(status, {});
  failed_.reset();
  call.reply(context_.journal.end(), {});
}

absl::Status WorldSlot::resume_stored(Sessions& sessions) {
  std::optional<StoredWorld> stored = context_.journal.take_stored();
  if (!stored) return absl::OkStatus();
  absl::StatusOr<WorldToLoad> from = world_from(stored->state);
  if (!from.ok()) return from.status();
  stored->state = {};
  const Tick tick = from->tick();
  auto hosted =
      std::make_unique<HostedWorld>(context_, std::make_shared<const WorldToLoad>(*std::move(from)),
                                    stored->load, context_.numbers.take_next(), std::vector<NodeId>());
  ActiveWorld& world = hosted->world();
  v1::StoredPace pace;
  for (const v1::StoredInput& input : stored->inputs) {
    if (input.has_pace()) pace = input.pace();
    if (input.has_carried_out()) sessions.remember({input.session(), input.number()}, input.carried_out());
    if (!input.has_commands()) continue;
    const v1::RecordedCommands& commands = input.commands();
    if (commands.tick() <= tick) {
      return absl::DataLossError(absl::StrCat("stored commands of tick ", commands.tick(),
                                              " cannot be given to the stored state of tick ", tick));
    }
    absl::StatusOr<GivenCommands> given = give_again(commands, world.registry);
    if (!given.ok()) {
      return absl::DataLossError(absl::StrCat("stored commands of tick ", commands.tick(),
                                              " cannot be given again: ", given.status().message()));
    }
    sessions.remember({input.session(), input.number()}, given->applied);
    if (!given->commands.empty()) {
      world.sequencer.hold_at(commands.tick(), std::move(given->commands), std::move(given->new_shapes));
    }
  }
  world.sequencer.restore_pace(pace);
  context_.journal.resume(world.sequencer.certain());
  loads_ = stored->load;
  hosted_ = std::move(hosted);
  context_.log(absl::StrCat("the world '", world.name, "' was stored at tick ", tick,
                            " and goes on once servers have joined"));
  return absl::OkStatus();
}

void WorldSlot::advance(Nanoseconds now) {
  if (hosted_) check(hosted_->advance(now), now);
  if (waiting_ && now >= waiting_->deadline)
    end_waiting(absl::FailedPreconditionError(missing_servers(*waiting_)));
}

std::optional<Nanoseconds> WorldSlot::next_deadline() const {
  std::optional<Nanoseconds> earliest = hosted_ ? hosted_->next_deadline() : std::nullopt;
  if (waiting_ && (!earliest || waiting_->deadline < *earliest)) earliest = waiting_->deadline;
  return earliest;
}

const char* WorldSlot::state() const {
  if (hosted_) {
    if (hosted_->loading()) return "loading";
    if (hosted_->recovering()) return "recovering";
    return hosted_->world().sequencer.paused() ? "paused" : "running";
  }
  if (waiting_) return "loading";
  return failed_ ? "failed" : "empty";
}

v1::StatusReply WorldSlot::status(Nanoseconds now) const {
  v1::StatusReply reply;
  if (hosted_) {
    hosted_->describe(reply, now);
  } else if (failed_ && !waiting_) {
    reply = *failed_;
    reply.clear_servers();
  } else if (waiting_) {
    reply.set_world(waiting_->world.name());
  }
  reply.set_state(state());
  reply.set_store_failure(context_.journal.failure());
  reply.set_waits_for_store(context_.journal.waits());
  for (const Server& server : context_.members.servers()) describe(server, *reply.add_servers());
  return reply;
}

void WorldSlot::describe(const Server& server, v1::ServerStatus& status) const {
  status.set_node(server.node.value);
  status.set_stream_address(server.stream_address);
  status.set_precision(to_proto(server.precision));
  status.set_threads(server.threads);
  status.set_capacity(server.capacity);
  status.mutable_labels()->Add(server.labels.begin(), server.labels.end());
  status.set_peak_rss_bytes(server.peak_rss_bytes);
  status.set_suspect(server.suspect_since.has_value());
  status.set_drained(server.drained);
  const bool takes_part = hosted_ && hosted_->world().servers.rank_of(server.node);
  status.set_takes_part(takes_part);
  if (!takes_part) return;
  const TickStatistics& statistics = hosted_->world().statistics;
  const v1::TickReport& last = statistics.last_of(server.node);
  status.set_tick(server.tick);
  status.set_bodies(server.bodies);
  write(counts_from(last.counts()), *status.mutable_counts());
  write(statistics.durations_of(server.node).times(), *status.mutable_tick_ms());
  status.set_exchange_bytes(server.exchange_bytes);
  status.set_exchange_messages(server.exchange_messages);
  if (server.ground.tiles() > 0) *status.mutable_ground() = server.ground;
  status.set_own_ms(statistics.own_ms_of(server.node));
  status.set_slow(statistics.slow() == server.node);
}

}  // namespace tessera
