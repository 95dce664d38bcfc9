#include "simulator/simulated_cluster.h"

#include <utility>

#include "lpss/base/invariant.h"
#include "lpss/engine/load_engine.h"
#include "proto/convert.h"

namespace tessera {
namespace {

// The node whose timers trigger the faults.
constexpr NodeId kFaultsNode{2};
constexpr NodeId kFirstServer{100};

CoordinatorOptions options_for(std::uint32_t servers, const SimulatedClusterOptions& options) {
  CoordinatorOptions coordinator;
  coordinator.servers_wanted = servers;
  coordinator.inputs = options.inputs;
  coordinator.checkpoint_every = options.checkpoint_every;
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
      network_(seed, given.network),
      coordinator_options_(options_for(servers, given)) {
  start_coordinator();
  for (std::uint32_t i = 0; i < servers; ++i) start_server();
  run_coordinator();
}

void SimulatedCluster::start_coordinator() {
  CoordinatorOptions options = coordinator_options_;
  store_ = std::make_unique<MemoryStore>(disk_);
  options.store = store_.get();
  options.worlds_before = network_.now_ns();
  coordinator_ = std::make_unique<Coordinator>(options);
  const absl::Status resumed = coordinator_->resume_stored();
  invariant(resumed.ok(), "what a coordinator has stored, another one can read");
  coordinator_link_ = network_.connect(kCoordinatorNode);
  coordinator_timer_ns_ = 0;
  run_coordinator();
}

void SimulatedCluster::crash_coordinator() {
  network_.kill(kCoordinatorNode);
  coordinator_.reset();
  store_.reset();
  for (const std::function<void()>& lose : std::exchange(unanswered_, {})) lose();
}

void SimulatedCluster::start_server() {
  Server& server = servers_.emplace_back();
  server.node = NodeId{kFirstServer.value + servers_.size() - 1};
  server.link = network_.connect(server.node);
  SectorServerOptions options;
  options.precision = precision_;
  options.stream_address = "simulated";
  server.machine = std::make_unique<SectorServer>(
      options, load_engine, [this] { return now(); }, nullptr);
  server.machine->start(server.node, now());
  run_server(server);
}

SimulatedCluster::~SimulatedCluster() = default;

void SimulatedCluster::keep_timer(NodeId node, std::uint64_t& timer_ns, std::optional<Nanoseconds> deadline) {
  if (!deadline) return;
  const auto wanted = static_cast<std::uint64_t>(deadline->count());
  if (timer_ns != 0 && timer_ns <= wanted) return;
  timer_ns = std::max(wanted, network_.now_ns() + 1);
  network_.set_timer(node, timer_ns);
}

void SimulatedCluster::run_coordinator() {
  if (!coordinator_) return;
  for (const Delivery& delivery : coordinator_link_->receive({})) {
    coordinator_->receive(delivery.from, parsed(delivery), now());
  }
  coordinator_->advance(now());
  for (OutgoingMessage& out : coordinator_->take_messages()) {
    coordinator_link_->send(out.to, out.message.SerializeAsString());
  }
  keep_timer(kCoordinatorNode, coordinator_timer_ns_, coordinator_->next_deadline());
}

// A finished machine is kept but inactive: its last message may still be in transit.
void SimulatedCluster::run_server(Server& server) {
  if (server.machine->finished()) return;
  for (const Delivery& delivery : server.link->receive({})) {
    server.machine->receive(delivery.from, parsed(delivery), now());
  }
  server.machine->advance(now());
  while (server.machine->work_left()) server.machine->proceed(now());
  for (SectorServer::Outgoing& out : server.machine->take_messages()) {
    server.link->send(out.to, std::move(out.payload));
  }
  keep_timer(server.node, server.timer_ns, server.machine->next_deadline());
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
    if (is_timer) coordinator_timer_ns_ = 0;
    if (is_loss && coordinator_) coordinator_->suspect(event->peer, now());
    run_coordinator();
    return true;
  }
  for (Server& server : servers_) {
    if (server.node != event->node) continue;
    if (is_timer) server.timer_ns = 0;
    if (is_loss) server.machine->suspect(event->peer, now());
    run_server(server);
  }
  return true;
}

void SimulatedCluster::run_events(std::uint64_t count) {
  while (count > 0 && run_one_event()) --count;
}

void SimulatedCluster::meet(const FaultSchedule& faults) {
  const auto plan = [this, start_ns = network_.now_ns()](std::uint64_t time_ns, std::function<void()> fault) {
    faults_.emplace(start_ns + time_ns, std::move(fault));
    network_.set_timer(kFaultsNode, start_ns + time_ns);
  };
  for (const FaultSchedule::Cut& cut : faults.cuts) {
    plan(cut.begin_ns, [this, cut] { network_.cut(cut.node, cut.peer); });
    plan(cut.end_ns, [this, cut] { network_.heal(cut.node, cut.peer); });
  }
  for (const FaultSchedule::Crash& crash : faults.crashes) {
    plan(crash.time_ns, [this, crash] { network_.kill(crash.node); });
    plan(crash.restart_ns, [this] { start_server(); });
  }
  for (const FaultSchedule::CoordinatorCrash& crash : faults.coordinator_crashes) {
    plan(crash.time_ns, [this] { crash_coordinator(); });
    plan(crash.restart_ns, [this] { start_coordinator(); });
  }
}

void SimulatedCluster::run_faults() {
  while (!faults_.empty() && faults_.begin()->first <= network_.now_ns()) {
    faults_.extract(faults_.begin()).mapped()();
  }
}

void SimulatedCluster::outlast_faults() {
  while (!faults_.empty() && run_one_event()) {
  }
}

std::vector<NodeId> SimulatedCluster::servers() const {
  std::vector<NodeId> nodes;
  for (const Server& server : servers_) nodes.push_back(server.node);
  return nodes;
}

std::optional<absl::Status> SimulatedCluster::end_of(NodeId server) const {
  return servers_.at(server.value - kFirstServer.value).machine->finished();
}

absl::Status SimulatedCluster::load(const WorldDescription& world) {
  v1::LoadRequest request;
  *request.mutable_world() = to_proto(world);
  return call<v1::LoadRequest, v1::LoadReply>(std::move(request)).status();
}

absl::Status SimulatedCluster::restore(const SnapshotChunks& snapshot) {
  return call<RestoreChunks, v1::LoadReply>({/*replace=*/true, snapshot}).status();
}

absl::StatusOr<v1::StepReply> SimulatedCluster::step(std::uint64_t ticks) {
  v1::StepRequest request;
  request.set_ticks(ticks);
  return call<v1::StepRequest, v1::StepReply>(std::move(request));
}

absl::StatusOr<v1::HashReply> SimulatedCluster::hash() { return call<v1::HashRequest, v1::HashReply>({}); }

absl::StatusOr<v1::StatusReply> SimulatedCluster::status() {
  return call<v1::StatusRequest, v1::StatusReply>({});
}

}  // namespace tessera
