#include "coordinator/hosted_world.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <utility>

#include "coordinator/limits.h"
#include "lpss/base/invariant.h"
#include "proto/convert.h"
#include "proto/convert_counts.h"

namespace tessera {

HostedWorld::HostedWorld(const CoordinatorContext& context, std::shared_ptr<const WorldToLoad> from,
                         std::uint64_t load, std::uint64_t number, std::vector<NodeId> nodes)
    : context_(context),
      world_(active_world(*from, load, number, std::move(nodes), context.options.grant_window,
                          context.has_checkpoints())),
      balancing_(context, world_),
      links_(context.members.contact_timeout(), kLongMessageMax),
      changes_(context, world_, balancing_),
      torn_(context, world_, from->is_replay) {
  if (context.has_checkpoints()) checkpoints_.emplace(context, world_, std::move(from));
}

void HostedWorld::load(Placement placement, ActiveWorld::Load call) {
  world_.sectors = placement.sectors;
  world_.being_loaded = std::move(call);
  const Tick tick = world_.sequencer.certain();
  send_loads(std::move(placement), tick);
}

// Sends the servers of the world what they host of it, at the end of `tick`.
void HostedWorld::send_loads(Placement placement, Tick tick) {
  const std::vector<NodeId>& nodes = world_.servers.nodes();
  invariant(placement.loads.size() == nodes.size() && placement.map.servers() == nodes.size(),
            "every server of a world gets its part");
  for (std::size_t rank = 0; rank < nodes.size(); ++rank) {
    Server* server = context_.members.find(nodes[rank]);
    invariant(server != nullptr, "a world is sent to members");
    server->patience = std::max<Nanoseconds>(context_.members.timeout(), kLoadSilenceMax);
    server->bodies = server->exchange_bytes = server->exchange_messages = 0;
    server->map_epoch = placement.map.epoch();
    server->tick = tick;
    v1::LoadWorld& message = *context_.journal.send(server->node).mutable_load_world();
    message = std::move(placement.loads[rank]);
    message.set_load(world_.load);
    message.set_hash_ticks(static_cast<bool>(context_.options.inputs));
  }
  world_.map = std::move(placement.map);
}

absl::Status HostedWorld::on_loaded(Server& server, const v1::Loaded& loaded) {
  if (world_.servers.is_guest(server.node)) {
    changes_.guest_is_loaded(loaded);
    if (loaded.error().empty()) links_.have_met(server.node, world_.servers.nodes());
    return absl::OkStatus();
  }
  const std::optional<std::size_t> rank =
      world_.servers.hosts() ? std::nullopt : world_.servers.rank_of(server.node);
  if (rank && loaded.world() != world_.number) return absl::OkStatus();  // it has yet to load the next world
  server.patience = context_.members.timeout();
  if (!rank) return absl::OkStatus();
  if (!loaded.error().empty())
    return absl::FailedPreconditionError(
        absl::StrCat(title_of(server), " cannot load the world: ", loaded.error()));
  world_.servers.has_world(*rank);
  if (!world_.servers.hosts()) return absl::OkStatus();
  if (loading()) return absl::OkStatus();
  ++recoveries_;
  context_.log(absl::StrCat("the world '", world_.name, "' is on ", world_.servers.nodes().size(),
                            " servers, which repeat ",
                            world_.sequencer.certain() - checkpoints_->kept().earliest(), " ticks"));
  return absl::OkStatus();
}

void HostedWorld::end_load() {
  const ActiveWorld::Load call = *std::exchange(world_.being_loaded, std::nullopt);
  v1::LoadReply reply;
  reply.set_bodies(world_.registry.body_count());
  reply.set_sectors(world_.sectors);
  reply.set_servers(static_cast<std::uint32_t>(world_.servers.nodes().size()));
  call(absl::OkStatus(), reply);
  context_.log(absl::StrCat("the world '", world_.name, "' is loaded"));
}

absl::Status HostedWorld::on_report(Server& server, const v1::Report& report) {
  Roster& servers = world_.servers;
  const std::optional<std::size_t> rank = servers.rank_of(server.node);
  if (report.has_subscriptions() && rank) servers.subscribe(server.node, report.subscriptions());
  watch_links(server, report);
  if (report.world() != world_.number) return absl::OkStatus();
  const bool leaves = servers.leaver() && servers.leaver()->node == server.node;
  if (!rank && !leaves) return absl::OkStatus();
  server.map_epoch = report.map_epoch();
  server.tick = std::max(server.tick, report.tick());
  server.bodies = report.bodies();
  server.exchange_bytes = std::max(server.exchange_bytes, report.exchange_bytes());
  server.exchange_messages = std::max(server.exchange_messages, report.exchange_messages());
  server.ground = report.ground();
  for (const v1::TickReport& tick : report.ticks()) {
    torn_.add(tick);
    const std::optional<TickSums> whole = world_.statistics.add(server.node, tick);
    if (whole && context_.options.inputs) context_.options.inputs(recorded(*whole));
  }
  if (!rank) return absl::OkStatus();
  name_slow_server();
  absl::Status status = world_.sequencer.report(*rank, report.tick());
  if (status.ok()) {
    torn_.take_out();
    return status;
  }
  return absl::InternalError(absl::StrCat(title_of(server), " is out of step: ", status.message()));
}

// Whoever reports is there, whatever it does; of those that it misses, some may not be of this world any
// more.
void HostedWorld::watch_links(const Server& server, const v1::Report& report) {
  std::vector<v1::Unheard> unheard;
  if (report.world() == world_.number) {
    for (const v1::Unheard& one : report.unheard()) {
      if (world_.servers.cannot_lose(NodeId{one.node()})) unheard.push_back(one);
    }
  }
  if (world_.servers.is_guest(server.node)) {
    changes_.guest_awaits(unheard);
    unheard.clear();  // nobody waits for a guest
  }
  links_.on_report(server.node, unheard, server.last_heard);
}

std::vector<LinkWatch::Dropped> HostedWorld::take_cut_off(Nanoseconds now) {
  std::vector<LinkWatch::Dropped> dropped = links_.take_dropped(now);
  for (const LinkWatch::Dropped& one : dropped) {
    if (cut_off_.size() == kCutOffKept) cut_off_.pop_front();
    v1::CutOff& told = cut_off_.emplace_back();
    told.set_node(one.node.value);
    if (const Server* server = context_.members.find(one.node))
      told.set_stream_address(server->stream_address);
    for (const NodeId other : one.unheard_by) told.add_unheard_by(other.value);
    told.set_seconds(std::chrono::duration<double>(one.waited).count());
    told.set_tick(completed());
    ++cut_off_servers_;
  }
  return dropped;
}

// Tells the operator, once, whom the others wait for.
void HostedWorld::name_slow_server() {
  const std::optional<NodeId> slow = world_.statistics.slow();
  if (slow == told_slow_) return;
  told_slow_ = slow;
  if (!slow) return context_.log("no server slows the world any more");
  const Server* server = context_.members.find(*slow);
  context_.log(absl::StrFormat(
                   "%s slows the world: its part of a tick takes %.1f ms, that of any other less than half",
                   title_of(*server), world_.statistics.own_ms_of(*slow)),
               Severity::kWarning);
}

void HostedWorld::on_answer(NodeId from, v1::Answer answer) {
  if (answer.world() != world_.number) return;
  if (absl::Status status = world_.questions.answer(from, std::move(answer)); !status.ok()) {
    context_.log(
        absl::StrCat("an answer of server ", absl::Hex(from.value), " is ignored: ", status.message()),
        Severity::kWarning);
  }
}

// A world without servers waits a moment for more than have come.
absl::Status HostedWorld::on_joined(NodeId node, std::uint64_t newest_world, Nanoseconds now) {
  // One that was given up while it got ready for this world would not load it again, before it goes back.
  if (newest_world >= world_.number) world_.servers.add_unfit(node);
  if (loading() || !world_.servers.nodes().empty()) return absl::OkStatus();
  const std::size_t servers = context_.choice.chosen(world_.settings().precision).size();
  if (servers == 0) return absl::OkStatus();
  if (context_.choice.is_complete(servers)) return set_back();
  if (!gathers_until_) gathers_until_ = now + kGatherServers;
  return absl::OkStatus();
}

absl::Status HostedWorld::on_lost(NodeId node, const std::string& how, bool process_has_ended) {
  if (world_.servers.is_guest(node)) world_.servers.drop_guest();
  if (!world_.servers.cannot_lose(node)) return absl::OkStatus();
  if (process_has_ended && world_.servers.hosts()) fatal_.on_end(world_.sequencer.new_ticks_under_way());
  if (fatal_tick()) return absl::OkStatus();
  if (may_set_back()) return set_back();
  return absl::UnavailableError(absl::StrCat(how, "; the world cannot go on without it"));
}

std::optional<Tick> HostedWorld::fatal_tick() const {
  const std::optional<Tick> tick = fatal_.found();
  return tick && world_.sequencer.has_commands_at(*tick) ? tick : std::nullopt;
}

// A world that loses servers again and again at the same place would do so for ever.
bool HostedWorld::may_set_back() {
  if (loading() || !checkpoints_) return false;
  if (completed() > last_loss_) losses_in_place_ = 0;
  last_loss_ = completed();
  return ++losses_in_place_ <= kLossesInPlaceMax;
}

absl::Status HostedWorld::advance(Nanoseconds now) {
  return gathers_until_ && now >= *gathers_until_ ? set_back() : absl::OkStatus();
}

// Goes on from the earliest checkpoint on the servers that are there, which repeat the ticks since; or waits
// for one.
absl::Status HostedWorld::set_back() {
  invariant(checkpoints_.has_value(), "only a world with checkpoints goes back to one");
  const std::vector<NodeId> nodes = next_servers();
  links_.restart();
  gathers_until_.reset();
  balancing_.set_back();
  checkpoints_->set_back();
  for (const NodeId node : world_.servers.restart(nodes)) {
    if (context_.members.find(node) != nullptr)
      context_.journal.send(node).mutable_unload_world()->set_world(world_.number);
  }
  const Tick tick = checkpoints_->kept().earliest();
  world_.number = context_.numbers.take_next();
  world_.sequencer.rewind(world_.number, nodes.size(), tick, fatal_.suspects_beyond(completed()));
  world_.statistics.restart(nodes);
  const absl::Status sorry =
      absl::UnavailableError("the world was set back, for its servers have changed: ask again");
  for (v1::Question& question : world_.questions.restart(sorry)) world_.sequencer.ask(std::move(question));
  if (nodes.empty()) {
    context_.log(absl::StrCat("the world '", world_.name, "' waits for a server of ",
                              context_.choice.described(world_.settings().precision)),
                 Severity::kWarning);
    return absl::OkStatus();
  }
  absl::StatusOr<Placement> placement = checkpoints_->kept().place_earliest(
      world_.number, world_.settings(), world_.anchor, world_.registry.shapes().at(tick),
      context_.choice.hosts(nodes), world_.map.epoch() + 1, context_.options.balance_policy);
  if (!placement.ok()) {
    return {placement.status().code(),
            absl::StrCat("it cannot go on from tick ", tick, ": ", placement.status().message())};
  }
  // The streams that clients had at any server of the world go on at all that it has now.
  const v1::Subscriptions streams = world_.servers.take_subscriptions();
  for (std::size_t rank = 0; rank < nodes.size(); ++rank) {
    *placement->loads[rank].mutable_subscriptions() = streams.all();
    world_.servers.subscribe(nodes[rank], streams);
  }
  send_loads(*std::move(placement), tick);
  context_.log(absl::StrCat("the world '", world_.name, "' goes on from tick ", tick, " on ", nodes.size(),
                            " servers"));
  return absl::OkStatus();
}

// Those that are not known to be cut off from each other: the others join once that is over.
std::vector<NodeId> HostedWorld::next_servers() const {
  std::vector<NodeId> nodes = context_.choice.chosen(world_.settings().precision);
  for (const NodeId apart : links_.apart(nodes)) std::erase(nodes, apart);
  return context_.choice.ranked(std::move(nodes));
}

void HostedWorld::go_on(Nanoseconds now) {
  if (!loading()) {
    if (checkpoints_) {
      checkpoints_->tend(now);
    } else {
      world_.registry.shapes().drop_before(world_.sequencer.certain());
    }
  }
  if (loading() || !world_.servers.hosts() || context_.journal.waits()) {
    moved_ = false;
    return;
  }
  if (checkpoints_) changes_.tend(checkpoints_->kept(), now);
  balancing_.tend(now);
  Sequencer& sequencer = world_.sequencer;
  if (!sequencer.paused() && !moved_) world_.meter.start(completed(), now);
  for (v1::Grant& grant : sequencer.take_grants(now)) send_grant(std::move(grant));
  world_.meter.progress(completed(), now);
  moved_ = !sequencer.paused() || completed() < sequencer.certain();
  if (!moved_) world_.meter.stop(completed(), now);
}

void HostedWorld::send_grant(v1::Grant grant) {
  for (const v1::Question& question : grant.questions())
    world_.questions.asked(question.id(), world_.servers.nodes());
  v1::ClusterMessage message;
  *message.mutable_grant() = std::move(grant);
  for (const NodeId node : world_.servers.listeners()) context_.journal.send(node) = message;
  if (message.grant().map().nodes_size() > 0) changes_.change_servers(message.grant().map());
}

std::optional<Nanoseconds> HostedWorld::next_deadline() const {
  std::optional<Nanoseconds> earliest = gathers_until_;
  if (const auto due = links_.next_deadline(); due && (!earliest || *due < *earliest)) earliest = due;
  if (loading() || context_.journal.waits()) return earliest;
  for (const std::optional<Nanoseconds>& deadline :
       {world_.servers.hosts() ? world_.sequencer.next_due() : std::nullopt,
        checkpoints_ ? checkpoints_->next_deadline() : std::nullopt, balancing_.next_deadline(),
        changes_.next_deadline()}) {
    if (deadline && (!earliest || *deadline < *earliest)) earliest = deadline;
  }
  return earliest;
}

void HostedWorld::suspend(const absl::Status& status) {
  world_.sequencer.suspend(status);
  world_.questions.abandon(status);
}

absl::Status HostedWorld::come_back() {
  if (!checkpoints_) return absl::UnavailableError("without checkpoints, it cannot go on");
  return set_back();
}

void HostedWorld::take_streams(HostedWorld& other) {
  world_.servers.subscribe(NodeId{}, other.world_.servers.take_subscriptions());
}

void HostedWorld::abandon(const absl::Status& status) {
  if (const auto call = std::exchange(world_.being_loaded, std::nullopt)) (*call)(status, {});
  world_.sequencer.abandon(status);
  world_.questions.abandon(status);
}

void HostedWorld::describe(v1::StatusReply& reply, Nanoseconds now) const {
  const TickStatistics& statistics = world_.statistics;
  const TickSums& last = statistics.last();
  reply.set_world(world_.name);
  reply.set_tick(completed());
  reply.set_time(static_cast<double>(completed()) * world_.settings().time_step);
  reply.set_real_time_factor(world_.meter.factor(world_.settings().time_step, now));
  reply.set_bodies(world_.registry.body_count());
  TickCounts counts = last.counts;
  if (last.tick == 0) counts.sectors = world_.sectors;
  write(counts, *reply.mutable_counts());
  write(statistics.counts_since_load(), *reply.mutable_counts_since_load());
  write(statistics.durations().times(), *reply.mutable_tick_ms());
  for (const Divergence& divergence : statistics.divergences()) {
    v1::Divergence& told = *reply.add_divergences();
    told = to_proto(divergence);
    if (const auto* body = world_.registry.find(divergence.body)) told.set_body_name(body->name);
    if (const auto* joint = world_.registry.joints().find(divergence.joint)) told.set_joint_name(joint->name);
  }
  reply.set_map_epoch(world_.map.epoch());
  reply.set_moved_sectors(balancing_.moved_sectors());
  reply.set_moved_bodies(balancing_.moved_bodies());
  reply.set_joined_servers(world_.servers.joined());
  reply.set_left_servers(world_.servers.left());
  reply.set_load(world_.load);
  reply.set_recoveries(recoveries_);
  reply.mutable_cut_off()->Add(cut_off_.begin(), cut_off_.end());
  reply.set_cut_off_servers(cut_off_servers_);
  if (checkpoints_) reply.set_checkpoint_tick(checkpoints_->kept().latest());
  *reply.mutable_settings() = to_proto(world_.settings());
  *reply.mutable_anchor() = to_proto(world_.anchor);
}

}  // namespace tessera
