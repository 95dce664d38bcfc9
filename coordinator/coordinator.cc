#include "coordinator/coordinator.h"

#include <absl/container/flat_hash_set.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <concepts>
#include <utility>

#include "coordinator/context.h"
#include "coordinator/drains.h"
#include "coordinator/limits.h"
#include "coordinator/recording.h"
#include "coordinator/sessions.h"
#include "coordinator/unanswered.h"
#include "coordinator/world_calls.h"
#include "coordinator/world_slot.h"

namespace tessera {
namespace {

template <typename Call>
concept AboutLoadedWorld = requires(Call& call, WorldCalls& world) {
  world.on(call);
};

}  // namespace

// Takes what comes to those whom it concerns, and sees to it that they do what is due by then.
class Coordinator::Impl {
 public:
  explicit Impl(const CoordinatorOptions& options);

  absl::Status resume_stored() { return slot_.resume_stored(sessions_); }
  void handle(const std::function<std::optional<ClientRequest>()>& next, Nanoseconds now);
  void receive(NodeId from, v1::ClusterMessage message, Nanoseconds now);
  bool suspect(NodeId node, Nanoseconds now);
  // `how`: why, as "has ended".
  void lost(NodeId node, const std::string& how, Nanoseconds now, bool process_has_ended = false);
  void advance(Nanoseconds now);
  void retire();
  void abandon();

  std::optional<Nanoseconds> next_deadline() const;
  std::vector<OutgoingMessage> take_messages() { return journal_.take_messages(); }
  std::map<NodeId, std::string> server_addresses() const;
  bool finished() const { return finished_ && !journal_.holds_back(); }
  const RoleWork::ByRole& costs_by_role() const { return role_work_.costs(); }
  const DurationHistogram* tick_durations() const {
    return slot_.hosted() ? &slot_.hosted()->world().statistics.durations() : nullptr;
  }

 private:
  template <typename Request, typename Answer>
  using Call = ClientCall<Request, Answer>;

  void on(Call<v1::LoadRequest, v1::LoadReply>& call, Nanoseconds now) { slot_.load(call, now); }
  void on(Call<RestoreChunks, v1::LoadReply>& call, Nanoseconds now) { slot_.load(call, now); }
  void on(Call<v1::UnloadRequest, v1::UnloadReply>& call, Nanoseconds) { slot_.unload(call); }
  void on(Call<v1::StatusRequest, v1::StatusReply>& call, Nanoseconds now) {
    call.reply(absl::OkStatus(), slot_.status(now));
  }
  void on(Call<v1::BalanceRequest, v1::BalanceReply>& call, Nanoseconds now);
  void on(Call<v1::DrainRequest, v1::DrainReply>& call, Nanoseconds now);
  void on(Call<v1::ShutdownRequest, v1::ShutdownReply>& call, Nanoseconds now);
  void on(Call<v1::Request, v1::Reply>& call, Nanoseconds now);
  template <AboutLoadedWorld AnyCall>
  void on(AnyCall& call, Nanoseconds now);

  void handle_one(ClientRequest& request, Nanoseconds now);
  void on_hello(NodeId from, const v1::Hello& hello, Nanoseconds now);
  void on_stranger(NodeId from);
  void heard(Server& server, Nanoseconds now);
  bool is_lost_deaf(Server& server, bool is_deaf, Nanoseconds now) const;

  void lost(const std::map<NodeId, std::string>& servers, Nanoseconds now, bool process_has_ended = false);
  void drop(const std::map<NodeId, std::string>& servers, Nanoseconds now);
  std::map<NodeId, std::string> silent(Nanoseconds now) const;
  std::map<NodeId, std::string> cut_off(Nanoseconds now);

  const Sequencer* running() const;
  void flush(Nanoseconds now);
  void answer_drains();
  void shut_down(const std::string& reason);
  void leave_world(const absl::Status& status);

  const CoordinatorOptions options_;
  const EventLog log_;
  Membership members_;
  const ServerChoice choice_;
  WorldNumbers numbers_;
  Journal journal_;
  RoleWork role_work_;
  const CoordinatorContext context_;
  Sessions sessions_;
  WorldSlot slot_;
  Drains drains_;
  absl::flat_hash_set<NodeId> strangers_;  // unknown servers that have been notified
  bool finished_ = false;
};

Coordinator::Impl::Impl(const CoordinatorOptions& options)
    : options_(options),
      log_(options.log,
           [this] {
             const HostedWorld* hosted = slot_.hosted();
             return hosted && !hosted->loading() ? std::optional(hosted->completed()) : std::nullopt;
           }),
      members_(options.server_timeout,
               options.checkpoint_every > Nanoseconds::zero() ? options.contact_timeout : kStallMax),
      choice_(members_, options.servers_wanted, options.required_labels),
      numbers_(options.worlds_before, options.worlds_max),
      journal_(options.store, options.wait_for_store, log_),
      role_work_(options.observe_share),
      context_{options_, log_, members_, choice_, numbers_, journal_, role_work_},
      slot_(context_) {}

// The sequence of the world that is loaded; null where there is none.
const Sequencer* Coordinator::Impl::running() const {
  const HostedWorld* hosted = slot_.hosted();
  return hosted && !hosted->loading() ? &hosted->world().sequencer : nullptr;
}

void Coordinator::Impl::handle(const std::function<std::optional<ClientRequest>()>& next, Nanoseconds now) {
  bool has_any = false;
  for (; std::optional<ClientRequest> request = next(); has_any = true) handle_one(*request, now);
  if (has_any) flush(now);
}

void Coordinator::Impl::handle_one(ClientRequest& request, Nanoseconds now) {
  std::visit(
      [&]<typename Request, typename Answer>(Call<Request, Answer>& call) {
        if (finished_) return call.reply(absl::UnavailableError("the coordinator is shutting down"), {});
        if constexpr (RestsOnStore<Answer> && !std::same_as<Answer, v1::Reply>) {
          journal_.answer_once_stored(call);
        }
        if (options_.inputs) record_on_reply(call, options_.inputs);
        if (!call.role) return on(call, now);
        const ClientRole role = *call.role;
        const bool world_ticks = running() != nullptr && running()->ticks();
        // Everybody may always know how the cluster is.
        const bool may_refuse = world_ticks && !std::same_as<Answer, v1::StatusReply>;
        if (absl::Status status = role_work_.admit(role, may_refuse, now); !status.ok())
          return call.reply(status, {});
        const Nanoseconds began = context_.work_clock();
        on(call, now);
        role_work_.add_work(role, context_.work_clock() - began, world_ticks);
      },
      request);
}

// Queries alone change nothing: they may be made again.
void Coordinator::Impl::on(Call<v1::Request, v1::Reply>& call, Nanoseconds now) {
  std::optional<v1::Applied> carried_out;
  if (!call.request.commands().empty() || call.request.ticks() > 0) {
    Sessions::Admission admission = sessions_.admit(call);
    if (admission.is_taken) return;
    carried_out = std::move(admission.carried_out);
    journal_.answer_once_stored(call);  // what is remembered of it is what was answered in the end
  } else {
    sessions_.take_answered(call);
  }
  const absl::StatusOr<HostedWorld*> live = slot_.live();
  if (!live.ok()) return call.reply(live.status(), {});
  const RequestId id = call.id;
  const std::optional<v1::Applied> applied =
      WorldCalls(context_, (*live)->world(), now).on(call, std::move(carried_out));
  if (applied) sessions_.note(id, *applied);
}

template <AboutLoadedWorld AnyCall>
void Coordinator::Impl::on(AnyCall& call, Nanoseconds now) {
  const absl::StatusOr<HostedWorld*> live = slot_.live();
  if (!live.ok()) return call.reply(live.status(), {});
  WorldCalls(context_, (*live)->world(), now).on(call);
}

void Coordinator::Impl::on(Call<v1::BalanceRequest, v1::BalanceReply>& call, Nanoseconds) {
  const absl::StatusOr<HostedWorld*> live = slot_.live();
  if (!live.ok()) return call.reply(live.status(), {});
  (*live)->balancing().answer(call);
}

void Coordinator::Impl::on(Call<v1::DrainRequest, v1::DrainReply>& call, Nanoseconds) {
  Server* server = members_.find(NodeId{call.request.node()});
  if (server == nullptr) {
    return call.reply(absl::NotFoundError(absl::StrCat("node ", absl::Hex(call.request.node()),
                                                       " is not a server of this cluster")),
                      {});
  }
  if (slot_.hosted() && slot_.hosted()->world().servers.rank_of(server->node)) {
    if (!context_.has_checkpoints()) {
      return call.reply(absl::FailedPreconditionError(
                            "the world cannot move: the coordinator was started without checkpoints"),
                        {});
    }
    const std::vector<NodeId> others = choice_.fit(server->precision);
    if (std::ranges::all_of(others, [&](NodeId node) { return node == server->node; })) {
      return call.reply(absl::FailedPreconditionError(absl::StrCat(
                            "no other server of ", choice_.described(server->precision), " could take over")),
                        {});
    }
  }
  if (absl::Status status = drains_.room(); !status.ok()) return call.reply(status, {});
  server->drained = true;
  drains_.add(server->node, std::move(call.reply));
}

void Coordinator::Impl::on(Call<v1::ShutdownRequest, v1::ShutdownReply>& call, Nanoseconds) {
  shut_down("the cluster is shutting down");
  call.reply(absl::OkStatus(), {});
}

// Sends all grants that are due, and stores and answers what has come.
void Coordinator::Impl::flush(Nanoseconds now) {
  const bool was_waiting = journal_.waits();
  if (slot_.hosted()) slot_.hosted()->go_on(now);
  answer_drains();
  if (journal_.take_dropped()) {
    sessions_.for_each([this](RequestId id, const v1::Applied& applied) { journal_.keep(id, applied); });
  }
  journal_.flush(running(), now);
  if (was_waiting && !journal_.waits()) flush(now);  // with what is due by now
}

void Coordinator::Impl::answer_drains() {
  const HostedWorld* hosted = slot_.hosted();
  drains_.answer([&](NodeId node) { return hosted && hosted->world().servers.needs(node); },
                 hosted ? hosted->completed() : 0);
}

void Coordinator::Impl::receive(NodeId from, v1::ClusterMessage message, Nanoseconds now) {
  using Kind = v1::ClusterMessage::KindCase;
  if (finished_) return;
  if (message.kind_case() == Kind::kHello) {
    on_hello(from, message.hello(), now);
    return flush(now);
  }
  Server* server = members_.find(from);
  if (server == nullptr) {
    if (message.kind_case() != Kind::kGoodbye) on_stranger(from);
    return;
  }
  heard(*server, now);
  HostedWorld* hosted = slot_.hosted();
  switch (message.kind_case()) {
    case Kind::kLoaded:
      if (hosted) {
        slot_.on_loaded(*server, message.loaded(), now);
      } else {
        server->patience = members_.timeout();
      }
      break;
    case Kind::kReport:
      server->peak_rss_bytes = message.report().peak_rss_bytes();
      if (is_lost_deaf(*server, message.report().deaf(), now)) {
        const double time = std::chrono::duration<double>(now - *server->deaf_since).count();
        return drop({{from, absl::StrCat("did not hear the coordinator for ", time, " s")}}, now);
      }
      if (hosted) slot_.check(hosted->on_report(*server, message.report()), now);
      break;
    case Kind::kAnswer:
      if (hosted) hosted->on_answer(from, std::move(*message.mutable_answer()));
      break;
    case Kind::kGoodbye:
      lost(from, absl::StrCat("left: ", message.goodbye().reason()), now);
      break;
    default:
      log_(absl::StrCat(title_of(*server), " sent a message that is not meant for a coordinator"),
           Severity::kWarning);
  }
  flush(now);
}

void Coordinator::Impl::on_hello(NodeId from, const v1::Hello& hello, Nanoseconds now) {
  const bool is_new = members_.find(from) == nullptr;
  if (is_new && hello.again()) return on_stranger(from);
  if (absl::Status status = members_.admit(from, hello, now); !status.ok()) {
    log_(absl::StrCat("refused server ", absl::Hex(from.value), ": ", status.message()), Severity::kWarning);
    journal_.send(from).mutable_refusal()->set_reason(std::string(status.message()));
    return;
  }
  Server& server = *members_.find(from);
  numbers_.heard_of(hello.newest_world());
  heard(server, now);
  strangers_.erase(from);
  const auto heartbeat = std::min<Nanoseconds>(members_.timeout() / 4, kHeartbeatMax);
  journal_.send(from).mutable_welcome()->set_heartbeat_ms(static_cast<std::uint64_t>(
      std::max<std::int64_t>(std::chrono::duration_cast<std::chrono::milliseconds>(heartbeat).count(), 1)));
  if (!is_new) return;
  log_(absl::StrCat(title_of(server), " joined, precision ", name_of(server.precision), ", ", server.threads,
                    " threads"));
  slot_.try_start(now);
  if (HostedWorld* hosted = slot_.hosted())
    slot_.check(hosted->on_joined(from, hello.newest_world(), now), now);
}

// The server was given up, or belongs to a coordinator that is gone: it must not continue on its own, and may
// join as if it were new.
void Coordinator::Impl::on_stranger(NodeId from) {
  if (strangers_.size() >= kStrangersMax) strangers_.clear();
  if (!strangers_.insert(from).second) return;
  v1::Refusal& refusal = *journal_.send(from).mutable_refusal();
  refusal.set_reason("the server is not, or is no longer, part of this coordinator's cluster");
  refusal.set_may_rejoin(true);
}

void Coordinator::Impl::heard(Server& server, Nanoseconds now) {
  server.last_heard = now;
  if (!std::exchange(server.suspect_since, std::nullopt)) return;
  log_(absl::StrCat(title_of(server), " is responding again"));
}

// Whether it has not heard the coordinator for too long.
bool Coordinator::Impl::is_lost_deaf(Server& server, bool is_deaf, Nanoseconds now) const {
  if (is_deaf && server.deaf_since) return now >= *server.deaf_since + server.contact_patience;
  if (is_deaf) {
    log_(absl::StrCat(title_of(server), " does not hear the coordinator"), Severity::kWarning);
    server.deaf_since = now;
  } else if (std::exchange(server.deaf_since, std::nullopt)) {
    log_(absl::StrCat(title_of(server), " hears the coordinator again"));
  }
  return false;
}

bool Coordinator::Impl::suspect(NodeId node, Nanoseconds now) {
  Server* server = members_.find(node);
  if (server == nullptr) return false;
  if (server->suspect_since) return true;
  server->suspect_since = now;
  const double left = std::chrono::duration<double>(server->deadline() - now).count();
  log_(absl::StrCat(title_of(*server), " is not responding: it counts as lost in ", left, " s"),
       Severity::kWarning);
  return true;
}

void Coordinator::Impl::lost(NodeId node, const std::string& how, Nanoseconds now, bool process_has_ended) {
  lost(std::map<NodeId, std::string>{{node, how}}, now, process_has_ended);
}

// All of them are gone before a world looks for servers to go on with.
void Coordinator::Impl::lost(const std::map<NodeId, std::string>& servers, Nanoseconds now,
                             bool process_has_ended) {
  if (finished_) return;
  std::map<NodeId, std::string> failures;
  for (const auto& [node, how] : servers) {
    const Server* server = members_.find(node);
    if (server == nullptr) continue;
    const std::string& failure = failures[node] = absl::StrCat(title_of(*server), " ", how);
    log_(failure, Severity::kWarning);
    members_.remove(node);
  }
  for (const auto& [node, failure] : failures) {
    slot_.on_lost(node, failure, process_has_ended, sessions_, now);
  }
  if (!failures.empty()) flush(now);
}

// They are told to join anew: they do not know that the world goes on without them.
void Coordinator::Impl::drop(const std::map<NodeId, std::string>& servers, Nanoseconds now) {
  if (servers.empty()) return;
  lost(servers, now);
  for (const auto& [node, how] : servers) on_stranger(node);
}

std::map<NodeId, std::string> Coordinator::Impl::silent(Nanoseconds now) const {
  std::map<NodeId, std::string> servers;
  for (const NodeId node : members_.silent(now)) {
    const double silence = std::chrono::duration<double>(now - members_.find(node)->last_heard).count();
    servers[node] = absl::StrCat("was silent for ", silence, " s");
  }
  return servers;
}

std::map<NodeId, std::string> Coordinator::Impl::cut_off(Nanoseconds now) {
  std::map<NodeId, std::string> servers;
  if (!slot_.hosted()) return servers;
  const auto title = [this](NodeId node) {
    const Server* server = members_.find(node);
    return server == nullptr ? absl::StrCat("server ", absl::Hex(node.value)) : title_of(*server);
  };
  for (const LinkWatch::Dropped& one : slot_.hosted()->take_cut_off(now)) {
    servers[one.node] = absl::StrFormat(
        "is given up: for %.2f s it has not been heard by, or has not heard, %s, though all of them respond "
        "to the "
        "coordinator",
        std::chrono::duration<double>(one.waited).count(),
        absl::StrJoin(one.unheard_by, ", ",
                      [&](std::string* out, NodeId other) { absl::StrAppend(out, title(other)); }));
  }
  return servers;
}

std::map<NodeId, std::string> Coordinator::Impl::server_addresses() const {
  std::map<NodeId, std::string> addresses;
  for (const Server& server : members_.servers()) addresses[server.node] = server.stream_address;
  return addresses;
}

void Coordinator::Impl::advance(Nanoseconds now) {
  if (finished_) return journal_.flush(nullptr, now);
  if (const auto due = next_deadline(); due && now > *due + kLateMax) members_.spare_until(now + kLateMax);
  drop(silent(now), now);
  drop(cut_off(now), now);
  slot_.advance(now);
  flush(now);
}

std::optional<Nanoseconds> Coordinator::Impl::next_deadline() const {
  if (finished_) return std::nullopt;
  std::optional<Nanoseconds> earliest = members_.next_deadline();
  for (const auto& deadline : {journal_.next_try(), slot_.next_deadline()}) {
    if (deadline && (!earliest || *deadline < *earliest)) earliest = deadline;
  }
  return earliest;
}

void Coordinator::Impl::shut_down(const std::string& reason) {
  log_(reason);
  const absl::Status status = absl::UnavailableError(reason);
  slot_.close(status);
  answer_drains();
  for (const Server& server : members_.servers())
    journal_.send(server.node).mutable_goodbye()->set_reason(reason);
  finished_ = true;
  journal_.drop_unstored(status);
}

// Leaves the world, and the servers, to whoever takes over.
void Coordinator::Impl::retire() {
  if (finished_) return;
  if (!journal_.stores() || !slot_.hosted()) return shut_down("the coordinator was asked to end");
  log_("leaving the world to the next coordinator");
  const absl::Status status = absl::UnavailableError("the coordinator is being replaced");
  journal_.flush_at_once(running());
  if (journal_.waits()) journal_.drop_unstored(status);
  leave_world(status);
  journal_.flush_at_once(nullptr);
}

// Whoever leads now tells others what is true.
void Coordinator::Impl::abandon() {
  const absl::Status status = unanswered_error(
      "this coordinator does not lead any more: what it has not answered may have taken effect or not");
  leave_world(status);
  journal_.abandon(status);
}

void Coordinator::Impl::leave_world(const absl::Status& status) {
  slot_.abandon(status);
  drains_.abandon(status);
  finished_ = true;
}

Coordinator::Coordinator(const CoordinatorOptions& options) : impl_(std::make_unique<Impl>(options)) {}
Coordinator::~Coordinator() = default;

void Coordinator::handle(const std::function<std::optional<ClientRequest>()>& next, Nanoseconds now) {
  impl_->handle(next, now);
}
void Coordinator::handle(ClientRequest request, Nanoseconds now) {
  std::optional<ClientRequest> one = std::move(request);
  impl_->handle([&one] { return std::exchange(one, std::nullopt); }, now);
}
void Coordinator::receive(NodeId from, v1::ClusterMessage message, Nanoseconds now) {
  impl_->receive(from, std::move(message), now);
}
bool Coordinator::suspect(NodeId server, Nanoseconds now) { return impl_->suspect(server, now); }
void Coordinator::ended(NodeId server, Nanoseconds now) {
  impl_->lost(server, "has ended", now, /*process_has_ended=*/true);
}
std::map<NodeId, std::string> Coordinator::server_addresses() const { return impl_->server_addresses(); }
void Coordinator::advance(Nanoseconds now) { impl_->advance(now); }
std::optional<Nanoseconds> Coordinator::next_deadline() const { return impl_->next_deadline(); }
std::vector<OutgoingMessage> Coordinator::take_messages() { return impl_->take_messages(); }
absl::Status Coordinator::resume_stored() { return impl_->resume_stored(); }
void Coordinator::retire() { impl_->retire(); }
void Coordinator::abandon() { impl_->abandon(); }
bool Coordinator::finished() const { return impl_->finished(); }
const DurationHistogram* Coordinator::tick_durations() const { return impl_->tick_durations(); }
const RoleWork::ByRole& Coordinator::costs_by_role() const { return impl_->costs_by_role(); }

}  // namespace tessera
