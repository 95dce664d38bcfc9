#include "coordinator/world_slot.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "coordinator/limits.h"
#include "coordinator/placement.h"
#include "coordinator/recording.h"
#include "coordinator/stored_inputs.h"
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
  world->is_replay = call.request.replay();
  call.request = {};  // the description has everything, and the request may be large
  wait_to_load(*std::move(world), std::move(call.reply), now);
}

void WorldSlot::load(ClientCall<RestoreChunks, v1::LoadReply>& call, Nanoseconds now) {
  if (absl::Status status = may_load(call.request.replace); !status.ok()) return call.reply(status, {});
  absl::StatusOr<WorldToLoad> world = restored_world(call.request.chunks);
  if (!world.ok()) return call.reply(world.status(), {});
  world->is_replay = call.request.replay;
  call.request = {};
  wait_to_load(*std::move(world), std::move(call.reply), now);
}

void WorldSlot::wait_to_load(WorldToLoad world, ActiveWorld::Load reply, Nanoseconds now) {
  waiting_ = WaitingLoad{std::move(reply), std::make_shared<const WorldToLoad>(std::move(world)),
                         now + context_.options.join_timeout};
  try_start(now);
}

std::string WorldSlot::missing_servers(const WaitingLoad& load) const {
  const Precision precision = load.world->settings().precision;
  const auto drained = std::ranges::count(context_.members.servers(), true, &Server::drained);
  return absl::StrCat("the world '", load.world->name(), "' needs ", context_.choice.servers_min(),
                      " servers of ", context_.choice.described(precision), ", but there are ",
                      context_.choice.fit(precision).size(), " after waiting for ",
                      std::chrono::duration<double>(context_.options.join_timeout).count(), " s",
                      drained == 0 ? "" : absl::StrCat(", and ", drained, " that are drained"));
}

void WorldSlot::try_start(Nanoseconds now) {
  if (!waiting_) return;
  const std::vector<NodeId> nodes = context_.choice.chosen(waiting_->world->settings().precision);
  if (nodes.size() < context_.choice.servers_min()) return;
  start(*std::exchange(waiting_, std::nullopt), context_.choice.ranked(nodes), now);
}

void WorldSlot::end_waiting(const absl::Status& status) {
  if (!waiting_) return;
  const WaitingLoad load = *std::exchange(waiting_, std::nullopt);
  context_.log(std::string(status.message()), Severity::kWarning);
  load.reply(status, {});
}

// Its servers need no message where they stay for the next world: a load replaces what they have.
void WorldSlot::unload_except(const HostedWorld& hosted, const std::vector<NodeId>& staying) const {
  for (const NodeId node : hosted.world().servers.listeners()) {
    if (std::find(staying.begin(), staying.end(), node) != staying.end()) continue;
    if (context_.members.find(node) != nullptr)
      context_.journal.send(node).mutable_unload_world()->set_world(hosted.world().number);
  }
}

void WorldSlot::end_hosted(const absl::Status& status) {
  if (const std::unique_ptr<HostedWorld> left = std::move(replaced_)) left->abandon(status);
  started_.reset();
  if (!hosted_) return;
  const std::unique_ptr<HostedWorld> ended = std::move(hosted_);
  ended->abandon(status);
  unload_except(*ended, {});
}

// What is there stays, and stays stored, until the new world has begun.
void WorldSlot::start(WaitingLoad load, const std::vector<NodeId>& nodes, Nanoseconds now) {
  absl::StatusOr<Placement> placement =
      place(context_.numbers.next(), *load.world, context_.choice.hosts(nodes), /*map_epoch=*/1,
            context_.options.balance_policy);
  if (!placement.ok()) {
    load.reply(placement.status(), {});
    return bring_back(now);
  }
  if (hosted_) {
    hosted_->suspend(absl::FailedPreconditionError("the world is being replaced by another"));
    unload_except(*hosted_, nodes);
    replaced_ = std::move(hosted_);
  }
  hosted_ =
      std::make_unique<HostedWorld>(context_, load.world, ++loads_, context_.numbers.take_next(), nodes);
  hosted_->load(*std::move(placement), load.reply);
  started_ = std::move(load);
  const ActiveWorld& world = hosted_->world();
  context_.log(absl::StrCat("loading the world '", world.name, "': ", world.registry.body_count(),
                            " bodies on ", nodes.size(), " servers"));
}

void WorldSlot::on_loaded(Server& server, const v1::Loaded& loaded, Nanoseconds now) {
  check(hosted_->on_loaded(server, loaded), now);
  if (hosted_ && hosted_->is_everywhere()) end_load(now);
}

void WorldSlot::end_load(Nanoseconds now) {
  if (absl::Status status = context_.journal.begin(hosted_->world().load, *started_->world); !status.ok()) {
    WaitingLoad load = drop_load(status);
    load.reply(status, {});
    return bring_back(now);
  }
  if (replaced_) replaced_->abandon(absl::FailedPreconditionError("the world was replaced by another"));
  replaced_.reset();
  started_.reset();
  failed_.reset();
  left_out_.clear();
  hosted_->end_load();
}

WorldSlot::WaitingLoad WorldSlot::drop_load(const absl::Status& status) {
  context_.log(
      absl::StrCat("the world '", hosted_->world().name, "' could not be loaded: ", status.message()),
      Severity::kWarning);
  unload_except(*hosted_, {});
  hosted_.reset();
  return *std::exchange(started_, std::nullopt);
}

// Of a world that some server could not load, or was lost before it had: it is loaded anew, once enough
// servers are there; what was there before comes back where that cannot be.
void WorldSlot::try_again(const absl::Status& status, Nanoseconds now) {
  WaitingLoad load = drop_load(status);
  if (absl::IsUnavailable(status) && ++load.tries < kLoadTriesMax) {
    load.deadline = now + context_.options.join_timeout;
    waiting_ = std::move(load);
    return try_start(now);
  }
  load.reply(status, {});
  bring_back(now);
}

void WorldSlot::bring_back(Nanoseconds now) {
  if (!replaced_) return;
  hosted_ = std::move(replaced_);
  check(hosted_->come_back(), now);
}

void WorldSlot::close(const absl::Status& status) {
  end_waiting(status);
  end_hosted(status);
}

void WorldSlot::abandon(const absl::Status& status) {
  end_waiting(status);
  if (const std::unique_ptr<HostedWorld> left = std::move(replaced_)) left->abandon(status);
  if (const std::unique_ptr<HostedWorld> left = std::move(hosted_)) left->abandon(status);
}

// What is stored of a world that cannot go on is set aside, so that it can be looked at, and gone on with.
void WorldSlot::check(const absl::Status& status, Nanoseconds now) {
  if (status.ok()) return;
  if (hosted_->loading()) return try_again(status, now);
  const absl::StatusOr<std::string> aside = context_.journal.set_aside(std::string(status.message()));
  const std::string where = aside.ok() && !aside->empty()
                                ? absl::StrCat("; what was stored of it is in ", *aside,
                                               ": a coordinator with --store ", *aside, " goes on with it")
                                : std::string();
  v1::StatusReply last = this->status(now);
  last.set_state("failed");
  last.set_failure(absl::StrCat(status.message(), where));
  failed_ = std::move(last);
  context_.log(absl::StrCat("the world '", hosted_->world().name, "' has failed: ", failed_->failure()),
               Severity::kError);
  end_hosted(status);
}

void WorldSlot::unload(ClientCall<v1::UnloadRequest, v1::UnloadReply>& call) {
  if (!hosted_ && !waiting_ && !failed_)
    return call.reply(absl::FailedPreconditionError("no world is loaded"), {});
  const absl::Status status = absl::FailedPreconditionError("the world was unloaded");
  end_waiting(status);
  if (hosted_) context_.log(absl::StrCat("the world '", hosted_->world().name, "' is unloaded"));
  end_hosted(status);
  failed_.reset();
  call.reply(context_.journal.end(), {});
}

// In its stored state, with the inputs since, and without servers.
absl::StatusOr<std::unique_ptr<HostedWorld>> WorldSlot::stored_world(StoredWorld stored, Sessions& sessions) {
  absl::StatusOr<WorldToLoad> from = world_from(stored.state);
  if (!from.ok()) return from.status();
  if (!context_.options.inputs) stored.state = {};  // it may be large
  const Tick tick = from->tick();
  auto hosted =
      std::make_unique<HostedWorld>(context_, std::make_shared<const WorldToLoad>(*std::move(from)),
                                    stored.load, context_.numbers.take_next(), std::vector<NodeId>());
  const absl::StatusOr<GivenInputs> inputs = give_inputs(stored, tick, hosted->world(), sessions);
  if (!inputs.ok()) return inputs.status();
  hosted->world().sequencer.restore_pace(inputs->pace);
  for (const v1::LeftOut& each : inputs->left_out) {
    context_.log(absl::StrCat("the world goes on without the commands of a request at tick ", each.tick(),
                              ": ", each.reason(), "; they were ", each.commands()),
                 Severity::kError);
    left_out_.push_back(each);
    if (left_out_.size() > kLeftOutMax) left_out_.pop_front();
  }
  if (!inputs->left_out.empty() && context_.options.inputs)
    record_anew(stored, *inputs, context_.options.inputs);
  return hosted;
}

absl::Status WorldSlot::resume_stored(Sessions& sessions) {
  std::optional<StoredWorld> stored = context_.journal.take_stored();
  if (!stored) return absl::OkStatus();
  for (const std::string& line : stored->repaired)
    context_.log(absl::StrCat("made good from its copy: ", line), Severity::kWarning);
  absl::StatusOr<std::unique_ptr<HostedWorld>> hosted = stored_world(*std::move(stored), sessions);
  if (!hosted.ok()) return hosted.status();
  hosted_ = *std::move(hosted);
  const ActiveWorld& world = hosted_->world();
  loads_ = world.load;
  context_.journal.resume(world.sequencer.certain());
  context_.log(absl::StrCat("the world '", world.name, "' was stored at tick ", hosted_->completed(),
                            " and goes on once servers have joined"));
  return absl::OkStatus();
}

void WorldSlot::on_lost(NodeId node, const std::string& how, bool process_has_ended, Sessions& sessions,
                        Nanoseconds now) {
  if (!hosted_) return;
  absl::Status status = hosted_->on_lost(node, how, process_has_ended);
  if (const std::optional<Tick> tick = hosted_->fatal_tick(); status.ok() && tick) {
    status = leave_out(*tick, sessions, now);
    if (!status.ok()) {
      context_.log(absl::StrCat("the commands of tick ", *tick,
                                " end servers, and cannot be left out: ", status.message()),
                   Severity::kError);
      status = hosted_->come_back();
    }
  }
  check(status, now);
}

// The world as a coordinator that is started anew would find it, but for what ends servers at that tick.
absl::Status WorldSlot::leave_out(Tick tick, Sessions& sessions, Nanoseconds now) {
  absl::StatusOr<StoredWorld> stored = context_.journal.leave_out(tick, now);
  if (!stored.ok()) return stored.status();
  left_out_.clear();  // what is still stored of it comes again
  absl::StatusOr<std::unique_ptr<HostedWorld>> next = stored_world(*std::move(stored), sessions);
  if (!next.ok()) return next.status();
  const std::unique_ptr<HostedWorld> left = std::exchange(hosted_, *std::move(next));
  left->abandon(
      absl::UnavailableError("the world was set back, for commands have ended its servers: ask again"));
  unload_except(*left, context_.choice.chosen(hosted_->world().settings().precision));
  hosted_->take_streams(*left);
  context_.journal.resume(hosted_->world().sequencer.certain());
  return hosted_->come_back();
}

void WorldSlot::advance(Nanoseconds now) {
  if (hosted_) check(hosted_->advance(now), now);
  if (waiting_ && now >= waiting_->deadline) {
    end_waiting(absl::FailedPreconditionError(missing_servers(*waiting_)));
    bring_back(now);
  }
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
    reply.set_world(waiting_->world->name());
  }
  reply.set_state(state());
  reply.set_store_failure(context_.journal.failure());
  reply.set_waits_for_store(context_.journal.waits());
  *reply.mutable_left_out() = {left_out_.begin(), left_out_.end()};
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
  status.set_suspect(server.suspect_since || server.deaf_since ||
                     (hosted_ && hosted_->is_doubtful(server.node)));
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
