#include "coordinator/coordinator.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <utility>

#include "coordinator/coordinator_impl.h"
#include "coordinator/limits.h"
#include "coordinator/recording.h"

namespace tessera {

Coordinator::Impl::Impl(const CoordinatorOptions& options)
    : options_(options),
      members_(options.server_timeout,
               options.checkpoint_every > Nanoseconds::zero() ? options.contact_timeout : kStallMax),
      worlds_(options.worlds_before) {}

v1::ClusterMessage& Coordinator::Impl::send(NodeId to) {
  return outbox_.emplace_back(OutgoingMessage{to, {}}).message;
}

// To all servers of the world, and one that gets ready to be one.
void Coordinator::Impl::send_grant(v1::Grant grant) {
  for (const v1::Query& query : grant.queries()) world_->queries.asked(query.id(), world_->nodes);
  v1::ClusterMessage message;
  *message.mutable_grant() = std::move(grant);
  for (const NodeId node : world_->nodes) send(node) = message;
  if (world_->guest) send(world_->guest->node) = message;
  if (message.grant().map().nodes_size() > 0) change_servers(message.grant().map());
}

void Coordinator::Impl::log(std::string text, Severity severity) const {
  if (!options_.log) return;
  LogLine line{.severity = severity, .text = std::move(text)};
  if (world_ && !world_->loading()) line.tick = world_->sequencer.completed();
  options_.log(line);
}

void Coordinator::Impl::handle(ClientRequest request, Nanoseconds now) {
  std::visit(
      [&](auto& call) {
        if (finished_) {
          call.reply(absl::UnavailableError("the coordinator is shutting down"), {});
        } else {
          if (!is_new(call)) return;
          reply_once_stored(call);  // what is remembered of it is what was answered in the end
          if (options_.inputs) record_on_reply(call, options_.inputs);
          on(call, now);
        }
      },
      request);
  flush(now);
}

// Sends all grants that are due, and stores and answers what has come.
void Coordinator::Impl::flush(Nanoseconds now) {
  const bool was_waiting = waits_for_store();
  send_grants(now);
  store_inputs(now);
  if (was_waiting && !waits_for_store()) flush(now);  // with what is due by now
}

// Also updates the real-time factor.
void Coordinator::Impl::send_grants(Nanoseconds now) {
  if (world_ && !world_->loading()) tend_checkpoints(now);
  if (!world_ || world_->loading() || !world_->hosted() || waits_for_store()) {
    was_moving_ = false;
    return;
  }
  Sequencer& sequencer = world_->sequencer;
  tend_servers(now);
  tend_balance(now);
  if (!sequencer.paused() && !was_moving_) world_->meter.start(sequencer.completed(), now);
  for (v1::Grant& grant : sequencer.take_grants(now)) send_grant(std::move(grant));
  world_->meter.progress(sequencer.completed(), now);
  const bool moving = !sequencer.paused() || sequencer.completed() < sequencer.certain();
  if (!moving) world_->meter.stop(sequencer.completed(), now);
  was_moving_ = moving;
}

void Coordinator::Impl::receive(NodeId from, v1::ClusterMessage message, Nanoseconds now) {
  using Kind = v1::ClusterMessage::KindCase;
  if (finished_) return;
  if (message.kind_case() == Kind::kHello) {
    on_hello(from, message.hello(), now);
    flush(now);
    return;
  }
  Server* server = members_.find(from);
  if (server == nullptr) {
    if (message.kind_case() != Kind::kGoodbye) on_stranger(from);
    return;
  }
  heard(*server, now);
  switch (message.kind_case()) {
    case Kind::kLoaded:
      on_loaded(from, message.loaded(), now);
      break;
    case Kind::kReport:
      on_report(*server, message.report(), now);
      break;
    case Kind::kAnswer:
      on_answer(from, std::move(*message.mutable_answer()));
      break;
    case Kind::kGoodbye:
      lost(from, absl::StrCat("left: ", message.goodbye().reason()), now);
      break;
    default:
      log(absl::StrCat(title_of(*server), " sent a message that is not meant for a coordinator"),
          Severity::kWarning);
  }
  flush(now);
}

void Coordinator::Impl::on_hello(NodeId from, const v1::Hello& hello, Nanoseconds now) {
  const bool is_new = members_.find(from) == nullptr;
  if (is_new && hello.again()) {
    on_stranger(from);
    return;
  }
  if (absl::Status status = members_.admit(from, hello, now); !status.ok()) {
    log(absl::StrCat("refused server ", absl::Hex(from.value), ": ", status.message()), Severity::kWarning);
    send(from).mutable_refusal()->set_reason(std::string(status.message()));
    return;
  }
  if (hello.newest_world() <= options_.worlds_max) worlds_ = std::max(worlds_, hello.newest_world());
  heard(*members_.find(from), now);
  strangers_.erase(from);
  const auto heartbeat = std::min<Nanoseconds>(members_.timeout() / 4, kHeartbeatMax);
  send(from).mutable_welcome()->set_heartbeat_ms(static_cast<std::uint64_t>(
      std::max<std::int64_t>(std::chrono::duration_cast<std::chrono::milliseconds>(heartbeat).count(), 1)));
  if (!is_new) return;
  const Server& server = *members_.find(from);
  log(absl::StrCat(title_of(server), " joined, precision ", name_of(server.precision), ", ", server.threads,
                   " threads"));
  try_start();
  // One that was given up while it got ready for this world would not load it again, before it goes back.
  if (world_ && hello.newest_world() >= world_->number) world_->unfit.insert(from);
  if (world_ && !world_->loading() && world_->nodes.empty()) gather(now);
}

// The server was given up, or belongs to a coordinator that is gone: it must not continue on its own, and may
// join as if it were new.
void Coordinator::Impl::on_stranger(NodeId from) {
  if (strangers_.size() >= kStrangersMax) strangers_.clear();
  if (!strangers_.insert(from).second) return;
  v1::Refusal& refusal = *send(from).mutable_refusal();
  refusal.set_reason("the server is not, or is no longer, part of this coordinator's cluster");
  refusal.set_may_rejoin(true);
}

void Coordinator::Impl::on_loaded(NodeId from, const v1::Loaded& loaded, Nanoseconds now) {
  Server& server = *members_.find(from);
  if (world_ && world_->guest && world_->guest->node == from) return guest_is_loaded(loaded);
  const std::optional<std::size_t> rank = world_ && !world_->hosted() ? world_->rank_of(from) : std::nullopt;
  if (rank && loaded.world() != world_->number) return;  // this server has yet to load the next world
  server.patience = members_.timeout();
  if (!rank) return;
  if (!loaded.error().empty()) {
    fail_world(absl::StrCat(title_of(server), " cannot load the world: ", loaded.error()),
               absl::StatusCode::kFailedPrecondition, now);
    return;
  }
  world_->ready[*rank] = true;
  if (!world_->hosted()) return;
  if (world_->loading()) {
    finish_load();
  } else {
    go_on_again();
  }
}

void Coordinator::Impl::on_report(Server& server, const v1::Report& report, Nanoseconds now) {
  server.peak_rss_bytes = report.peak_rss_bytes();
  if (report.has_subscriptions() && world_ && world_->rank_of(server.node)) {
    world_->subscriptions[server.node] = report.subscriptions();
  }
  if (!world_ || report.world() != world_->number) return;
  const std::optional<std::size_t> rank = world_->rank_of(server.node);
  const bool leaves = world_->leaving && world_->leaving->node == server.node;
  if (!rank && !leaves) return;
  server.map_epoch = report.map_epoch();
  server.tick = std::max(server.tick, report.tick());
  server.bodies = report.bodies();
  server.exchange_bytes = std::max(server.exchange_bytes, report.exchange_bytes());
  server.exchange_messages = std::max(server.exchange_messages, report.exchange_messages());
  server.ground = report.ground();
  for (const v1::TickReport& tick : report.ticks()) {
    const std::optional<TickSums> whole = world_->statistics.add(server.node, tick);
    if (whole && options_.inputs) options_.inputs(recorded(*whole));
  }
  if (!rank) return;
  name_slow_server();
  if (absl::Status status = world_->sequencer.report(*rank, report.tick()); !status.ok()) {
    fail_world(absl::StrCat(title_of(server), " is out of step: ", status.message()),
               absl::StatusCode::kInternal, now);
  }
}

// Tells the operator, once, whom the others wait for.
void Coordinator::Impl::name_slow_server() {
  const std::optional<NodeId> slow = world_->statistics.slow();
  if (slow == world_->told_slow) return;
  world_->told_slow = slow;
  if (!slow) return log("no server slows the world any more");
  const Server* server = members_.find(*slow);
  log(absl::StrFormat(
          "%s slows the world: its part of a tick takes %.1f ms, that of any other less than half",
          title_of(*server), world_->statistics.own_ms_of(*slow)),
      Severity::kWarning);
}

void Coordinator::Impl::on_answer(NodeId from, v1::Answer answer) {
  if (!world_ || answer.world() != world_->number) return;
  if (absl::Status status = world_->queries.answer(from, std::move(answer)); !status.ok()) {
    log(absl::StrCat("an answer of server ", absl::Hex(from.value), " is ignored: ", status.message()),
        Severity::kWarning);
  }
}

void Coordinator::Impl::heard(Server& server, Nanoseconds now) {
  server.last_heard = now;
  if (!std::exchange(server.suspect_since, std::nullopt)) return;
  log(absl::StrCat(title_of(server), " is responding again"));
}

bool Coordinator::Impl::suspect(NodeId node, Nanoseconds now) {
  Server* server = members_.find(node);
  if (server == nullptr) return false;
  if (server->suspect_since) return true;
  server->suspect_since = now;
  const double left = std::chrono::duration<double>(server->deadline() - now).count();
  log(absl::StrCat(title_of(*server), " is not responding: it counts as lost in ", left, " s"),
      Severity::kWarning);
  return true;
}

void Coordinator::Impl::lost(NodeId node, const std::string& how, Nanoseconds now) {
  const Server* server = members_.find(node);
  if (finished_ || server == nullptr) return;
  const std::string failure = absl::StrCat(title_of(*server), " ", how);
  log(failure, Severity::kWarning);
  members_.remove(node);
  if (world_ && world_->guest && world_->guest->node == node) world_->guest.reset();
  const auto needs_leaver = [&](NodeId lost) {
    return world_->leaving && world_->leaving->node == lost && !world_->leaving->until;
  };
  if (world_ && (world_->rank_of(node) || needs_leaver(node))) {
    if (may_recover()) {
      recover();
    } else {
      fail_world(absl::StrCat(failure, "; the world cannot go on without it"), absl::StatusCode::kUnavailable,
                 now);
    }
  }
  answer_drains();
  flush(now);
}

std::map<NodeId, std::string> Coordinator::Impl::server_addresses() const {
  std::map<NodeId, std::string> addresses;
  for (const Server& server : members_.servers()) addresses[server.node] = server.stream_address;
  return addresses;
}

void Coordinator::Impl::advance(Nanoseconds now) {
  if (finished_) return store_inputs(now);
  if (const auto due = next_deadline(); due && now > *due + kLateMax) members_.spare_until(now + kLateMax);
  if (world_ && world_->gathers_until && now >= *world_->gathers_until) recover();
  for (const NodeId node : members_.silent(now)) {
    const auto silence = now - members_.find(node)->last_heard;
    lost(node, absl::StrCat("was silent for ", std::chrono::duration<double>(silence).count(), " s"), now);
    on_stranger(node);
  }
  if (waiting_load_ && now >= waiting_load_->deadline) {
    give_up_waiting(absl::FailedPreconditionError(missing_servers(*waiting_load_)));
  }
  flush(now);
}

std::optional<Nanoseconds> Coordinator::Impl::next_deadline() const {
  if (finished_) return std::nullopt;
  std::optional<Nanoseconds> earliest = members_.next_deadline();
  const auto consider = [&](std::optional<Nanoseconds> deadline) {
    if (deadline && (!earliest || *deadline < *earliest)) earliest = deadline;
  };
  if (waiting_load_) consider(waiting_load_->deadline);
  if (stores() && !store_.failure.empty()) consider(store_.next_try);
  if (world_) consider(world_->gathers_until);
  if (world_ && !world_->loading() && !waits_for_store()) {
    if (world_->hosted()) consider(world_->sequencer.next_due());
    if (may_ask_for_checkpoint()) consider(world_->next_checkpoint);
    if (may_balance()) consider(world_->next_balance);
    if (world_->leaving) consider(world_->leaving->until);
  }
  return earliest;
}

void Coordinator::Impl::shut_down(const std::string& reason) {
  log(reason);
  const absl::Status status = absl::UnavailableError(reason);
  give_up_waiting(status);
  close_world(status, {});
  for (const Server& server : members_.servers()) send(server.node).mutable_goodbye()->set_reason(reason);
  finished_ = true;
  drop_unstored(status);
}

Coordinator::Coordinator(const CoordinatorOptions& options) : impl_(std::make_unique<Impl>(options)) {}
Coordinator::~Coordinator() = default;

void Coordinator::handle(ClientRequest request, Nanoseconds now) { impl_->handle(std::move(request), now); }
void Coordinator::receive(NodeId from, v1::ClusterMessage message, Nanoseconds now) {
  impl_->receive(from, std::move(message), now);
}
bool Coordinator::suspect(NodeId server, Nanoseconds now) { return impl_->suspect(server, now); }
void Coordinator::ended(NodeId server, Nanoseconds now) { impl_->lost(server, "has ended", now); }
std::map<NodeId, std::string> Coordinator::server_addresses() const { return impl_->server_addresses(); }
void Coordinator::advance(Nanoseconds now) { impl_->advance(now); }
std::optional<Nanoseconds> Coordinator::next_deadline() const { return impl_->next_deadline(); }
std::vector<OutgoingMessage> Coordinator::take_messages() { return impl_->take_messages(); }
absl::Status Coordinator::resume_stored() { return impl_->resume_stored(); }
void Coordinator::retire() { impl_->retire(); }
void Coordinator::abandon() { impl_->abandon(); }
bool Coordinator::finished() const { return impl_->finished(); }
const DurationHistogram* Coordinator::tick_durations() const { return impl_->tick_durations(); }

}  // namespace tessera
