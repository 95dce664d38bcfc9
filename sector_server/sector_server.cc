#include "sector_server/sector_server.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <set>

#include "lpss/base/arithmetic_fingerprint.h"
#include "proto/convert.h"
#include "proto/wire.h"
#include "sector_server/world_run.h"

namespace tessera {
namespace {

// Messages for a world whose load has not arrived yet; peers are at most a tick ahead.
constexpr std::size_t kEarlyMessagesMax = 4096;

// A coordinator wants to hear of its servers more often.
constexpr std::uint64_t kHeartbeatMsMax = 60'000;
constexpr std::chrono::milliseconds kMeasureMemoryEvery(500);
// What protobuf serialises: a larger message would be sent as an empty one.
constexpr std::size_t kClusterMessageBytesMax = std::numeric_limits<std::int32_t>::max();

// How often it says so while it does not hear the coordinator, which counts the time.
constexpr std::chrono::milliseconds kDeafEvery(100);

// How often a server says hello until it is welcome: the coordinator that heard it may be lost.
constexpr std::chrono::seconds kHelloEvery(1);

}  // namespace

class SectorServer::Impl {
 public:
  Impl(const SectorServerOptions& options, WorldRun::MakeEngine make_engine,
       std::function<Nanoseconds()> clock, TickObserver observer)
      : options_(options),
        make_engine_(std::move(make_engine)),
        clock_(std::move(clock)),
        observer_(std::move(observer)) {}

  void start(NodeId self, Nanoseconds now) {
    self_ = self;
    join_deadline_ = now + options_.join_timeout;
    say_hello(now);
  }

  void receive(NodeId from, v1::ClusterMessage message, Nanoseconds now) {
    using Kind = v1::ClusterMessage::KindCase;
    if (from != kCoordinatorNode && message.kind_case() != Kind::kRound &&
        message.kind_case() != Kind::kGreeting) {
      log(absl::StrCat("node ", absl::Hex(from.value), " sent a message that only a coordinator may send"),
          Severity::kWarning);
      return;
    }
    if (from != kCoordinatorNode) probes_.heard(from);
    const bool was_deaf = from == kCoordinatorNode && std::exchange(coordinator_deadline_, std::nullopt);
    switch (message.kind_case()) {
      case Kind::kWelcome:
        if (!heartbeat_) log("the coordinator has accepted this server");
        heartbeat_ = std::chrono::milliseconds(
            std::clamp<std::uint64_t>(message.welcome().heartbeat_ms(), 1, kHeartbeatMsMax));
        next_heartbeat_ = now + *heartbeat_;
        break;
      case Kind::kRefusal:
        if (message.refusal().may_rejoin()) {
          join_anew(message.refusal().reason(), now);
          break;
        }
        finish(absl::FailedPreconditionError(
            absl::StrCat("the coordinator refused this server: ", message.refusal().reason())));
        break;
      case Kind::kLoadWorld:
        load(*message.mutable_load_world());
        break;
      case Kind::kUnloadWorld:
        if (run_ && run_->world() == message.unload_world().world()) {
          log("the world is unloaded");
          run_.reset();
        }
        last_unloaded_ = std::max(last_unloaded_, message.unload_world().world());
        break;
      case Kind::kGrant:
      case Kind::kRound:
        deliver(from, std::move(message));
        break;
      case Kind::kGreeting:
        on_greeting(from, message.greeting());
        break;
      case Kind::kGoodbye:
        finish(absl::OkStatus());
        break;
      default:
        log("the coordinator sent a message that is not meant for sector servers", Severity::kWarning);
    }
    if (was_deaf) next_heartbeat_ = now;  // the coordinator is to know at once
  }

  bool work_left() const { return !finished_ && run_ && run_->ready(); }

  bool awaits_peers() const { return !finished_ && run_ && !run_->ready() && !run_->between_ticks(); }

  void work_while_waiting() {
    if (finished_ || !run_ || run_->is_guest()) return;
    const Nanoseconds began = clock_();
    run_->machine().work_while_waiting();
    run_->add_own_time(clock_() - began);
  }

  void proceed(Nanoseconds now) {
    if (!work_left()) return;
    if (absl::Status status = run_->proceed(clock_); !status.ok()) {
      finish(status);
      return;
    }
    if (const auto servers = run_->take_new_servers(); servers && options_.on_new_servers)
      options_.on_new_servers(*servers);
    if (run_->take_tick_done() && observer_) observer_(run_->tick(), run_->machine());
    if (run_->report_due()) report(now);
    if (run_->has_left()) leave_world(now);
  }

  void advance(Nanoseconds now) {
    if (!heartbeat_ && now >= join_deadline_) {
      finish(absl::DeadlineExceededError(absl::StrCat(
          "no coordinator answered within ", options_.join_timeout / std::chrono::seconds(1), " s")));
    }
    if ((!heartbeat_ || coordinator_deadline_) && now >= next_hello_) say_hello(now);
    if (coordinator_deadline_ && now >= *coordinator_deadline_) {
      finish(
          absl::UnavailableError(absl::StrCat("the coordinator did not respond for ",
                                              options_.coordinator_timeout / std::chrono::seconds(1), " s")));
    }
    if (heartbeat_ && options_.changed_subscriptions) {
      if (std::optional<v1::Subscriptions> changed = options_.changed_subscriptions()) {
        subscriptions_ = *std::move(changed);
        report(now);
      }
    }
    if (heartbeat_ && now >= next_look_) look_for_peers(now);
    if (heartbeat_ && now >= next_heartbeat_) report(now);
  }

  // A coordinator that has only stalled answers the hello once it continues.
  void suspect(NodeId node, Nanoseconds now) {
    if (node != kCoordinatorNode) return probes_.lost(node);
    if (!heartbeat_ || coordinator_deadline_) return;
    coordinator_deadline_ = now + options_.coordinator_timeout;
    log("the coordinator is not responding", Severity::kWarning);
    say_hello(now);
    report(now);  // which may reach it all the same
  }

  void leave(const std::string& reason) {
    if (finished_) return;
    say_goodbye(reason);
    finished_ = absl::OkStatus();
  }

  std::optional<Nanoseconds> next_deadline() const {
    if (!heartbeat_) return std::min(join_deadline_, next_hello_);
    Nanoseconds next = next_heartbeat_;
    if (awaits_peers() || awaits_links()) next = std::min(next, next_look_);
    if (!coordinator_deadline_) return next;
    return std::min({next, *coordinator_deadline_, next_hello_});
  }

  TickMachine* machine_between_ticks() {
    return run_ && run_->between_ticks() && !run_->is_guest() ? &run_->machine() : nullptr;
  }
  Tick tick() const { return run_ ? run_->tick() : 0; }
  bool joined() const { return heartbeat_ && !coordinator_deadline_; }
  const v1::TickReport* last_tick() const {
    return run_ && run_->last_report().tick() > 0 ? &run_->last_report() : nullptr;
  }
  WorldRun::Traffic traffic() const { return run_ ? run_->traffic() : WorldRun::Traffic{}; }
  std::vector<Outgoing> take_messages() { return std::exchange(outgoing_, {}); }
  const std::optional<absl::Status>& finished() const { return finished_; }

 private:
  void log(std::string text, Severity severity = Severity::kInfo) const {
    if (!options_.log) return;
    LogLine line{.severity = severity, .text = std::move(text)};
    if (run_) line.tick = run_->tick();
    options_.log(line);
  }

  void send(NodeId to, const v1::ClusterMessage& message) {
    const std::size_t bytes = message.ByteSizeLong();
    if (bytes > kClusterMessageBytesMax) {
      finished_ = absl::ResourceExhaustedError(
          absl::StrCat("a message of ", bytes, " bytes to another daemon may have at most ",
                       kClusterMessageBytesMax, ": use more servers, or smaller sectors"));
      return;
    }
    outgoing_.push_back({to, message.SerializeAsString()});
  }

  void say_hello(Nanoseconds now) {
    next_hello_ = now + kHelloEvery;
    v1::ClusterMessage message;
    v1::Hello& hello = *message.mutable_hello();
    hello.set_protocol(kClusterProtocol);
    hello.set_layout(wire_layout());
    hello.set_precision(to_proto(options_.precision));
    hello.set_threads(static_cast<std::uint32_t>(options_.threads));
    hello.set_stream_address(options_.stream_address);
    hello.set_again(heartbeat_.has_value());
    hello.set_arithmetic(arithmetic_fingerprint());
    hello.mutable_arithmetic_parts()->Add(arithmetic_parts().begin(), arithmetic_parts().end());
    hello.set_newest_world(newest());
    hello.set_capacity(options_.capacity > 0 ? options_.capacity : options_.threads);
    hello.mutable_labels()->Add(options_.labels.begin(), options_.labels.end());
    send(kCoordinatorNode, message);
  }

  // The coordinator has given this server up, or is another one: what is here now lives on elsewhere.
  void join_anew(const std::string& reason, Nanoseconds now) {
    log(absl::StrCat("joining the cluster anew: ", reason), Severity::kWarning);
    if (run_) last_unloaded_ = std::max(last_unloaded_, run_->world());
    run_.reset();
    early_.clear();
    heartbeat_.reset();
    coordinator_deadline_.reset();
    join_deadline_ = now + options_.join_timeout;
    say_hello(now);
  }

  void say_goodbye(const std::string& reason) {
    v1::ClusterMessage message;
    message.mutable_goodbye()->set_reason(reason);
    send(kCoordinatorNode, message);
  }

  // The first reason counts.
  void finish(const absl::Status& status) {
    if (finished_) return;
    finished_ = status;
    if (!status.ok()) say_goodbye(std::string(status.message()));
  }

  void load(v1::LoadWorld& world) {
    if (world.world() <= newest()) return;  // a later one has overtaken it
    run_.reset();
    absl::StatusOr<std::unique_ptr<WorldRun>> run =
        WorldRun::create(world, self_, options_.threads, make_engine_,
                         [this](NodeId to, const v1::ClusterMessage& message) { send(to, message); });
    v1::ClusterMessage message;
    v1::Loaded& loaded = *message.mutable_loaded();
    loaded.set_world(world.world());
    unanswered_.clear();
    if (run.ok()) {
      run_ = std::move(*run);
      run_->partition().all_linked_max = options_.all_linked_max;
      if (options_.on_load) options_.on_load(world);
      if (run_->is_guest()) {
        log("a running world is loaded, to take part in it");
        greet_all();
      } else {
        log(absl::StrCat("a world is loaded: ", run_->body_count(), " bodies live here"));
        if (observer_) observer_(run_->tick(), run_->machine());
      }
    } else {
      loaded.set_error(std::string(run.status().message()));
      log(absl::StrCat("a world cannot be loaded: ", run.status().message()), Severity::kWarning);
    }
    if (unanswered_.empty()) send(kCoordinatorNode, message);
    std::vector<std::pair<NodeId, v1::ClusterMessage>> early = std::exchange(early_, {});
    for (auto& [from, waiting] : early) deliver(from, std::move(waiting));
  }

  void send_greeting(NodeId to, bool is_answer) {
    v1::ClusterMessage message;
    message.mutable_greeting()->set_world(run_->world());
    message.mutable_greeting()->set_is_answer(is_answer);
    send(to, message);
  }

  // A guest is ready once links to all servers of its world work.
  void greet_all() {
    for (const NodeId node : run_->nodes()) {
      unanswered_.insert(node);
      send_greeting(node, false);
    }
  }

  bool awaits_links() const { return run_ && run_->is_guest() && !unanswered_.empty(); }

  void on_greeting(NodeId from, const v1::Greeting& greeting) {
    if (!run_ || run_->world() != greeting.world()) return;  // one that has been given up
    if (!greeting.is_answer()) {
      run_->welcome(from);
      return send_greeting(from, true);
    }
    if (unanswered_.erase(from) == 0 || !unanswered_.empty()) return;
    v1::ClusterMessage message;
    message.mutable_loaded()->set_world(run_->world());
    send(kCoordinatorNode, message);
  }

  // Asks those that this server has waited for, and tells the coordinator who does not answer.
  void look_for_peers(Nanoseconds now) {
    next_look_ = now + PeerProbes::kEvery;
    std::optional<PeerProbes::Wait> wait;
    if (run_) wait = run_->awaited();
    if (awaits_links()) wait = {.round = {}, .peers = {unanswered_.begin(), unanswered_.end()}, .others = {}};
    const bool any_before = probes_.any_unheard();
    for (const NodeId peer : probes_.look(wait)) send_greeting(peer, false);
    if (any_before || probes_.any_unheard()) report(now);
  }

  // Its sectors are at others, which do not wait for it any more.
  void leave_world(Nanoseconds now) {
    report(now);
    log("this server takes no part in the world any more");
    last_unloaded_ = std::max(last_unloaded_, run_->world());
    run_.reset();
    if (options_.on_left) options_.on_left();
  }

  // The number of the last world that was loaded or unloaded here.
  std::uint64_t newest() const { return std::max(run_ ? run_->world() : 0, last_unloaded_); }

  // Passes a grant or round to its world; keeps it if that world has not been loaded yet.
  void deliver(NodeId from, v1::ClusterMessage message) {
    const std::uint64_t world = message.has_grant() ? message.grant().world() : message.round().world();
    if (run_ && run_->world() == world) {
      const absl::Status status = message.has_grant() ? run_->take(std::move(*message.mutable_grant()))
                                                      : run_->take(from, std::move(*message.mutable_round()));
      if (!status.ok()) log(absl::StrCat("a message is ignored: ", status.message()), Severity::kWarning);
      return;
    }
    if (world <= newest()) return;  // for a world that has been unloaded
    if (early_.size() >= kEarlyMessagesMax) {
      finish(absl::ResourceExhaustedError("too many messages for a world that was not loaded"));
      return;
    }
    early_.emplace_back(from, std::move(message));
  }

  void report(Nanoseconds now) {
    v1::ClusterMessage message;
    v1::Report& report = *message.mutable_report();
    if (run_) {
      report.set_world(run_->world());
      report.set_tick(run_->tick());
      report.set_bodies(run_->body_count());
      const RoundTraffic sent = run_->traffic().all_sent();
      report.set_exchange_bytes(sent.bytes);
      report.set_exchange_messages(sent.messages);
      const TileStore::Counts tiles = TileStore::of_process().counts();
      if (tiles.made > 0) {
        v1::GroundTiles& ground = *report.mutable_ground();
        ground.set_tiles(tiles.tiles);
        ground.set_bytes(tiles.bytes);
        ground.set_waits(tiles.waits);
        ground.set_ticks_waited(run_->ticks_waited_for_ground());
      }
      report.set_moved_bytes(run_->moved_bytes());
      report.set_map_epoch(run_->map_epoch());
      for (v1::TickReport& tick : run_->take_reports()) *report.add_ticks() = std::move(tick);
    }
    if (options_.peak_rss_bytes && now >= next_measurement_) {
      peak_rss_bytes_ = options_.peak_rss_bytes();
      next_measurement_ = now + kMeasureMemoryEvery;
    }
    report.set_peak_rss_bytes(peak_rss_bytes_);
    report.set_deaf(coordinator_deadline_.has_value());
    probes_.write(report);
    if (subscriptions_) *report.mutable_subscriptions() = *std::exchange(subscriptions_, std::nullopt);
    send(kCoordinatorNode, message);
    if (!heartbeat_) return;
    next_heartbeat_ = now + *heartbeat_;
    if (coordinator_deadline_) next_heartbeat_ = std::min(next_heartbeat_, now + kDeafEvery);
  }

  SectorServerOptions options_;
  WorldRun::MakeEngine make_engine_;
  std::function<Nanoseconds()> clock_;
  TickObserver observer_;
  NodeId self_;
  Nanoseconds join_deadline_{};
  Nanoseconds next_hello_{};
  std::optional<Nanoseconds> heartbeat_;  // set once welcome
  Nanoseconds next_heartbeat_{};
  std::optional<Nanoseconds> coordinator_deadline_;  // while it is a suspect
  Nanoseconds next_measurement_{};
  std::uint64_t peak_rss_bytes_ = 0;
  std::optional<v1::Subscriptions> subscriptions_;  // to be reported
  std::unique_ptr<WorldRun> run_;
  PeerProbes probes_;
  Nanoseconds next_look_{};
  std::set<NodeId> unanswered_;  // servers of a guest's world that have yet to answer its greeting
  std::uint64_t last_unloaded_ = 0;
  std::vector<std::pair<NodeId, v1::ClusterMessage>> early_;
  std::vector<Outgoing> outgoing_;
  std::optional<absl::Status> finished_;
};

SectorServer::SectorServer(const SectorServerOptions& options, WorldRun::MakeEngine make_engine,
                           std::function<Nanoseconds()> clock, TickObserver observer)
    : impl_(std::make_unique<Impl>(options, std::move(make_engine), std::move(clock), std::move(observer))) {}
SectorServer::~SectorServer() = default;

void SectorServer::start(NodeId self, Nanoseconds now) { impl_->start(self, now); }
void SectorServer::receive(NodeId from, v1::ClusterMessage message, Nanoseconds now) {
  impl_->receive(from, std::move(message), now);
}
bool SectorServer::work_left() const { return impl_->work_left(); }
void SectorServer::proceed(Nanoseconds now) { impl_->proceed(now); }
void SectorServer::work_while_waiting() { impl_->work_while_waiting(); }
void SectorServer::advance(Nanoseconds now) { impl_->advance(now); }
void SectorServer::suspect(NodeId node, Nanoseconds now) { impl_->suspect(node, now); }
void SectorServer::leave(const std::string& reason) { impl_->leave(reason); }
std::optional<Nanoseconds> SectorServer::next_deadline() const { return impl_->next_deadline(); }
bool SectorServer::awaits_peers() const { return impl_->awaits_peers(); }
TickMachine* SectorServer::machine_between_ticks() { return impl_->machine_between_ticks(); }
Tick SectorServer::tick() const { return impl_->tick(); }
bool SectorServer::joined() const { return impl_->joined(); }
const v1::TickReport* SectorServer::last_tick() const { return impl_->last_tick(); }
WorldRun::Traffic SectorServer::traffic() const { return impl_->traffic(); }
std::vector<SectorServer::Outgoing> SectorServer::take_messages() { return impl_->take_messages(); }
const std::optional<absl::Status>& SectorServer::finished() const { return impl_->finished(); }

}  // namespace tessera
