#include "simulator/simulated_cluster.h"

#include "lpss/base/invariant.h"
#include "lpss/engine/load_engine.h"
#include "proto/convert.h"

namespace tessera {
namespace {

CoordinatorOptions options_for(std::uint32_t servers) {
  CoordinatorOptions options;
  options.servers_wanted = servers;
  return options;
}

v1::ClusterMessage parsed(const Delivery& delivery) {
  v1::ClusterMessage message;
  invariant(message.ParseFromString(delivery.payload), "simulated processes send what they can read");
  return message;
}

}  // namespace

SimulatedCluster::SimulatedCluster(std::uint64_t seed, std::uint32_t servers, Precision precision,
                                   const SimOptions& network)
    : network_(seed, network),
      coordinator_(options_for(servers)),
      coordinator_link_(network_.connect(kCoordinatorNode)) {
  for (std::uint32_t i = 0; i < servers; ++i) {
    Server server;
    server.node = NodeId{100 + i};
    server.link = network_.connect(server.node);
    SectorServerOptions options;
    options.precision = precision;
    options.stream_address = "simulated";
    server.machine = std::make_unique<SectorServer>(
        options, load_engine, [this] { return now(); }, nullptr);
    servers_.push_back(std::move(server));
  }
  for (Server& server : servers_) {
    server.machine->start(server.node, now());
    run_server(server);
  }
  run_coordinator();
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
  for (const Delivery& delivery : coordinator_link_->receive({})) {
    coordinator_.receive(delivery.from, parsed(delivery), now());
  }
  coordinator_.advance(now());
  for (OutgoingMessage& out : coordinator_.take_messages()) {
    coordinator_link_->send(out.to, out.message.SerializeAsString());
  }
  keep_timer(kCoordinatorNode, coordinator_timer_ns_, coordinator_.next_deadline());
}

void SimulatedCluster::run_server(Server& server) {
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
  if (event->node == kCoordinatorNode) {
    if (is_timer) coordinator_timer_ns_ = 0;
    run_coordinator();
    return true;
  }
  for (Server& server : servers_) {
    if (server.node != event->node) continue;
    if (is_timer) server.timer_ns = 0;
    run_server(server);
  }
  return true;
}

absl::Status SimulatedCluster::load(const WorldDescription& world) {
  v1::LoadRequest request;
  *request.mutable_world() = to_proto(world);
  return call<v1::LoadRequest, v1::LoadReply>(std::move(request)).status();
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
