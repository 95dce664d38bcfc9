#include "simulator/simulated_cluster.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <utility>

#include "coordinator/folder_store.h"
#include "lpss/base/invariant.h"
#include "lpss/engine/load_engine.h"
#include "proto/convert.h"
#include "simulator/processor_time.h"

namespace tessera {
namespace {

// The node whose timers trigger the faults.
constexpr NodeId kFaultsNode{2};
constexpr NodeId kFirstServer{100};
constexpr std::uint32_t kClockStream = 5;
constexpr std::uint64_t kNsPerMs = 1'000'000;
constexpr std::uint64_t kRestartNs = 1000 * kNsPerMs;  // of a process that ended by itself
constexpr std::int64_t kCalendarMs = 1'700'000'000'000;

CoordinatorOptions options_for(std::uint32_t servers, const SimulatedClusterOptions& options) {
  CoordinatorOptions coordinator;
  coordinator.servers_wanted = options.takes_all_servers ? 0 : servers;
  coordinator.inputs = options.inputs;
  coordinator.checkpoint_every = options.checkpoint_every;
  coordinator.balance_every = options.balance_every;
  coordinator.balance_ahead = options.balance_ahead;
  coordinator.balance_policy = options.balance_policy;
  coordinator.shape_bytes_max = options.shape_bytes_max;
  return coordinator;
}

v1::ClusterMessage parsed(const Delivery& delivery) {
  v1::ClusterMessage message;
  invariant(message.ParseFromString(delivery.payload), "simulated processes send valid messages");
  return message;
}

}  // namespace

SimulatedCluster::SimulatedCluster(std::uint64_t seed, std::uint32_t servers, Precision precision,
                                   const SimulatedClusterOptions& given)
    : precision_(precision),
      dice_(seed, kClockStream),
      network_(seed, given.network),
      options_(given),
      coordinator_options_(options_for(servers, given)),
      disk_(seed),
      coordinator_clock_(dice_),
      calendar_ms_(kCalendarMs) {
  start_coordinator();
  for (std::uint32_t i = 0; i < servers; ++i) start_server();
}

void SimulatedCluster::log(NodeId node, const LogLine& line) const {
  if (!options_.log) return;
  options_.log(absl::StrFormat(
      "%12.6f  %s %s%s", static_cast<double>(network_.now_ns()) / 1e9,
      node == kCoordinatorNode ? "coordinator" : absl::StrCat("server ", absl::Hex(node.value)),
      line.tick ? absl::StrCat("tick ", *line.tick, ": ") : "", line.text));
}

void SimulatedCluster::log_of_clients(const std::string& text) const {
  if (!options_.log) return;
  options_.log(absl::StrFormat("%12.6f  client %s", static_cast<double>(network_.now_ns()) / 1e9, text));
}

LogSink SimulatedCluster::sink_of(NodeId node) const {
  if (!options_.log) return {};
  return [this, node](const LogLine& line) { log(node, line); };
}

// Again and again, where the disk does not let it.
void SimulatedCluster::start_coordinator() {
  disk_.begin_user();
  absl::StatusOr<std::unique_ptr<WorldStore>> store = open_folder_store("store", disk_);
  if (!store.ok()) {
    if (!absl::IsUnavailable(store.status())) {
      failure_.Update(
          absl::AbortedError(absl::StrCat("the store cannot be opened: ", store.status().message())));
    }
    disk_.end_user();
    plan(network_.now_ns() + kRestartNs, [this] { start_coordinator(); });
    return;
  }
  store_ = std::make_unique<WatchedStore>(*std::move(store), history_);
  failure_.Update(store_->compare());
  CoordinatorOptions options = coordinator_options_;
  options.store = store_.get();
  options.worlds_before = static_cast<std::uint64_t>(calendar_ms_) + network_.now_ns() / kNsPerMs;
  options.log = sink_of(kCoordinatorNode);
  coordinator_ = std::make_unique<Coordinator>(options);
  if (const absl::Status resumed = coordinator_->resume_stored(); !resumed.ok()) {
    failure_.Update(absl::AbortedError(absl::StrCat("the store cannot be read: ", resumed.message())));
  }
  coordinator_link_ = network_.connect(kCoordinatorNode);
  coordinator_timer_ns_ = 0;
  run_coordinator();
}

void SimulatedCluster::crash_coordinator(bool loses_power) {
  disk_.end_user();
  dying_.reset();
  network_.kill(kCoordinatorNode);
  requests_.clear();
  coordinator_.reset();
  store_.reset();
  if (loses_power) disk_.lose_power();
  for (const std::function<void()>& lose : std::exchange(unanswered_, {})) lose();
}

void SimulatedCluster::crash_coordinator_for(bool loses_power, std::uint64_t absent_ns) {
  log(kCoordinatorNode, {.text = loses_power ? "(loses its power)" : "(crashes)"});
  crash_coordinator(loses_power);
  plan(network_.now_ns() + absent_ns, [this] { start_coordinator(); });
}

void SimulatedCluster::start_server() {
  servers_.push_back({.node = NodeId{kFirstServer.value + servers_.size()}, .clock = NodeClock(dice_)});
  Server& server = servers_.back();
  server.link = network_.connect(server.node);
  SectorServerOptions options;
  options.precision = precision_;
  options.stream_address = "simulated";
  options.all_linked_max = options_.all_linked_max;
  options.log = sink_of(server.node);
  const auto clock = [this, place = servers_.size() - 1] {
    return servers_[place].clock.at(network_.now_ns() + worked_ns());
  };
  server.machine = std::make_unique<SectorServer>(options, load_engine, clock, nullptr);
  server.machine->start(server.node, clock());
  run_server(server);
}

bool SimulatedCluster::end_server(NodeId node) {
  Server* server = find(node);
  if (server == nullptr || !server->machine) return false;
  log(node, {.text = "(ends without a word)"});
  network_.kill(node);
  server->machine.reset();
  return true;
}

bool SimulatedCluster::crash_server(NodeId node, std::uint64_t absent_ns) {
  if (!end_server(node)) return false;
  plan(network_.now_ns() + absent_ns, [this] { start_server(); });
  return true;
}

SimulatedCluster::~SimulatedCluster() { disk_.end_user(); }

void SimulatedCluster::keep_timer(NodeId node, const NodeClock& clock, std::uint64_t& timer_ns,
                                  std::optional<Nanoseconds> deadline) {
  if (!deadline) return;
  const std::uint64_t wanted = clock.when(*deadline);
  if (timer_ns != 0 && timer_ns <= wanted) return;
  timer_ns = std::max(wanted, network_.now_ns() + 1);
  network_.set_timer(node, timer_ns);
}

void SimulatedCluster::run_coordinator() {
  if (!coordinator_) return;
  const Nanoseconds begin = options_.measures_work ? processor_time_of_thread() : Nanoseconds(0);
  for (const std::function<void()>& request : std::exchange(requests_, {})) request();
  for (const Delivery& delivery : coordinator_link_->receive({})) {
    const v1::ClusterMessage message = parsed(delivery);
    if (options_.reports && message.has_report()) options_.reports(delivery.from, message.report());
    coordinator_->receive(delivery.from, message, now());
  }
  coordinator_->advance(now());
  if (options_.measures_work) measure(kCoordinatorNode, 0, processor_time_of_thread() - begin);
  std::vector<OutgoingMessage> messages = coordinator_->take_messages();
  if (disk_.user_has_ended()) {
    const Dying how = dying_.value_or(Dying{});
    return crash_coordinator_for(how.loses_power, how.absent_ns);
  }
  bool begins_world = false;
  for (OutgoingMessage& out : messages) {
    begins_world |= out.message.has_load_world() && out.message.load_world().has_restored();
    coordinator_link_->send(out.to, out.message.SerializeAsString());
  }
  keep_timer(kCoordinatorNode, coordinator_clock_, coordinator_timer_ns_, coordinator_->next_deadline());
  if (begins_world && !armed_.empty()) begin_crash_in_recovery();
}

void SimulatedCluster::send_done(Server& server) {
  for (SectorServer::Outgoing& out : std::exchange(server.done, {})) {
    server.link->send(out.to, std::move(out.payload));
  }
}

std::uint64_t SimulatedCluster::worked_ns() const {
  if (!work_began_) return 0;
  return static_cast<std::uint64_t>((processor_time_of_thread() - *work_began_).count());
}

void SimulatedCluster::measure(NodeId node, Tick tick, Nanoseconds work) {
  MeasuredWork& longest = node == kCoordinatorNode ? coordinator_work_ : server_work_;
  if (work > longest.longest) longest = {work, node, tick};
}

// A round of a tick.
void SimulatedCluster::do_work(Server& server) {
  const auto now = server.clock.at(network_.now_ns() + worked_ns());
  if (!options_.measures_work) return server.machine->proceed(now);
  const Tick before = server.machine->tick();
  const Nanoseconds begin = processor_time_of_thread();
  server.machine->proceed(now);
  server.work_of_tick += processor_time_of_thread() - begin;
  measure(server.node, before + 1, server.work_of_tick);
  if (server.machine->tick() != before) server.work_of_tick = Nanoseconds(0);
}

// A server that ends by itself is started anew, as its unit would do.
void SimulatedCluster::run_server(Server& server) {
  const auto now = [&] { return server.clock.at(network_.now_ns() + worked_ns()); };
  send_done(server);
  if (options_.takes_time) work_began_ = processor_time_of_thread();
  for (const Delivery& delivery : server.link->receive({})) {
    server.machine->receive(delivery.from, parsed(delivery), now());
  }
  server.machine->advance(now());
  while (server.machine->work_left()) do_work(server);
  server.done = server.machine->take_messages();
  const std::uint64_t worked = worked_ns();
  work_began_.reset();
  if (worked == 0 || server.machine->finished()) send_done(server);
  if (server.machine->finished()) {
    server.end = server.machine->finished();
    server.machine.reset();
    plan(network_.now_ns() + kRestartNs, [this, node = server.node] {
      network_.kill(node);  // its last message had time to leave
      start_server();
    });
    return;
  }
  keep_timer(server.node, server.clock, server.timer_ns, server.machine->next_deadline());
  if (!server.done.empty()) network_.set_timer(server.node, network_.now_ns() + worked);
  if (worked > 0) network_.keep_busy(server.node, network_.now_ns() + worked);
  if (server.work_ns > 0) network_.keep_busy(server.node, network_.now_ns() + server.work_ns);
}

absl::Status SimulatedCluster::no_answer() const {
  std::string text =
      absl::StrFormat("there is no answer after %d events, at %.9f s; coordinator %s", events_,
                      static_cast<double>(network_.now_ns()) / 1e9, coordinator_ ? "runs" : "is missing");
  for (const Server& server : servers_) {
    if (server.machine)
      absl::StrAppend(&text, ", server ", absl::Hex(server.node.value), " at ", server.machine->tick());
  }
  return absl::DeadlineExceededError(text);
}

bool SimulatedCluster::run_one_event() {
  const std::optional<SimEvent> event = network_.step();
  if (!event) return false;
  ++events_;
  const bool is_timer = event->kind == SimEvent::Kind::kTimer;
  const bool is_loss = event->kind == SimEvent::Kind::kLoss;
  if (event->node == kFaultsNode) {
    run_faults();
    return true;
  }
  if (event->node == kCoordinatorNode) {
    if (is_timer && event->time_ns >= coordinator_timer_ns_) coordinator_timer_ns_ = 0;
    if (is_loss && coordinator_ && !coordinator_->suspect(event->peer, now())) {
      network_.forget(kCoordinatorNode, event->peer);
    }
    run_coordinator();
    return true;
  }
  Server* server = find(event->node);
  if (server == nullptr || !server->machine) return true;
  if (is_timer && event->time_ns >= server->timer_ns) server->timer_ns = 0;
  if (is_loss) server->machine->suspect(event->peer, server->clock.at(network_.now_ns()));
  run_server(*server);
  return true;
}

void SimulatedCluster::run_events(std::uint64_t count) {
  while (count > 0 && run_one_event()) --count;
}

void SimulatedCluster::plan(std::uint64_t time_ns, std::function<void()> what) {
  faults_.emplace(time_ns, std::move(what));
  network_.set_timer(kFaultsNode, time_ns);
}

void SimulatedCluster::run_faults() {
  while (!faults_.empty() && faults_.begin()->first <= network_.now_ns()) {
    faults_.extract(faults_.begin()).mapped()();
  }
}

void SimulatedCluster::outlast_faults() {
  while (!faults_.empty() && failure_.ok() && run_one_event()) {
  }
  armed_.clear();
}

std::vector<NodeId> SimulatedCluster::servers() const {
  std::vector<NodeId> nodes;
  for (const Server& server : servers_) nodes.push_back(server.node);
  return nodes;
}

std::optional<absl::Status> SimulatedCluster::end_of(NodeId server) const {
  return servers_.at(server.value - kFirstServer.value).end;
}

absl::Status SimulatedCluster::load(const WorldDescription& world, bool replace) {
  v1::LoadRequest request;
  request.set_replace(replace);
  *request.mutable_world() = to_proto(world);
  return call<v1::LoadRequest, v1::LoadReply>(std::move(request)).status();
}

absl::Status SimulatedCluster::restore(const SnapshotChunks& snapshot, bool replay) {
  return call<RestoreChunks, v1::LoadReply>({/*replace=*/true, replay, snapshot}).status();
}

absl::Status SimulatedCluster::step(std::uint64_t ticks) {
  v1::Request request;
  request.set_ticks(ticks);
  return call<v1::Request, v1::Reply>(std::move(request)).status();
}

absl::StatusOr<SimulatedCluster::HashAt> SimulatedCluster::hash() {
  v1::Request request;
  request.add_queries()->mutable_hash();
  const absl::StatusOr<v1::Reply> reply = call<v1::Request, v1::Reply>(std::move(request));
  if (!reply.ok()) return reply.status();
  const v1::HashResult& result = reply->results(0).hash();
  return HashAt{reply->tick(), result.hash(), result.programs()};
}

absl::StatusOr<v1::StatusReply> SimulatedCluster::status() {
  return call<v1::StatusRequest, v1::StatusReply>({});
}

}  // namespace tessera
