// tessera-sector-server: hosts sectors of a world for a coordinator.
#include <absl/strings/str_cat.h>
#include <grpcpp/grpcpp.h>
#include <unistd.h>

#include <chrono>
#include <random>

#include "daemon/grpc_door.h"
#include "daemon/log.h"
#include "daemon/monitor.h"
#include "daemon/open_files.h"
#include "daemon/parent_process.h"
#include "daemon/stop_signals.h"
#include "keys/keys_folder.h"
#include "lpss/base/freed_memory.h"
#include "lpss/engine/load_engine.h"
#include "lpss/ground/tile_store.h"
#include "lpss/partition/bodies.h"
#include "proto/grpc_limits.h"
#include "proto/peak_memory.h"
#include "sector_server/metrics.h"
#include "sector_server/options.h"
#include "sector_server/sector_server.h"
#include "sector_server/streams.h"
#include "tiles/tile_folder.h"
#include "transport/dds_link.h"
#include "transport/waker.h"

namespace tessera {
namespace {

// How long a server looks for what another one owes it within a tick, before it sleeps.
constexpr std::chrono::microseconds kEager{200};

// How long a server that ends waits at most for clients to take what their streams have for them: as long as
// clients go on reading from a server that has left the world.
constexpr std::chrono::seconds kFarewell{5};

// Of gRPC: they accept calls, and refuse those beyond the limit.
constexpr std::size_t kThreadsBesideStreams = 64;

Nanoseconds since_start() {
  static const auto kStart = std::chrono::steady_clock::now();
  return std::chrono::steady_clock::now() - kStart;
}

NodeId drawn_node() {
  std::random_device source;
  const std::uint64_t high = source();
  const std::uint64_t value = (high << 32) | source();
  return NodeId{value <= kCoordinatorNode.value ? value + 2 : value};
}

// One thread owns the link and the state machine; the threads of gRPC only wake it.
absl::Status serve(DdsLink& link, SectorServer& server, Streams& streams, ServerMetrics& metrics,
                   const StopSignals& signals, Pulse& pulse) {
  const auto start = std::chrono::steady_clock::now() - since_start();
  const auto send = [&] {
    for (SectorServer::Outgoing& message : server.take_messages())
      link.send(message.to, std::move(message.payload));
  };
  server.start(link.self(), since_start());
  while (!server.finished() && !signals.wanted()) {
    pulse.beat();
    send();
    if (!server.work_left()) server.work_while_waiting();
    const std::optional<Nanoseconds> deadline = server.next_deadline();
    const auto until = server.work_left()
                           ? std::chrono::steady_clock::time_point{}
                           : start + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                                         deadline.value_or(since_start() + std::chrono::seconds(1)));
    const auto eager = server.awaits_peers() ? kEager : std::chrono::microseconds(0);
    std::vector<Delivery> deliveries = link.receive(until, eager);
    for (const NodeId node : link.take_lost_peers()) server.suspect(node, since_start());
    for (Delivery& delivery : deliveries) {
      v1::ClusterMessage message;
      const bool is_read = message.ParseFromString(delivery.payload);
      std::string().swap(delivery.payload);  // a world may be most of the memory that there is
      if (is_read) {
        server.receive(delivery.from, std::move(message), since_start());
      } else {
        log_warning(absl::StrCat("a message from node ", absl::Hex(delivery.from.value), " cannot be read"));
      }
    }
    send();  // whoever asks whether this server is there does not wait for what it does next
    server.proceed(since_start());
    server.advance(since_start());
    metrics.set_joined(server.joined());
    if (TickMachine* machine = server.machine_between_ticks()) streams.publish(server.tick(), *machine, true);
  }
  server.leave("it was asked to shut down");
  send();
  return server.finished().value_or(absl::OkStatus());
}

// Null if metrics are off.
absl::StatusOr<std::unique_ptr<Monitor>> open_monitor(const SectorServerArguments& arguments,
                                                      const std::optional<ServerKeys>& keys,
                                                      const ServerMetrics& metrics, const Pulse& pulse) {
  if (arguments.metrics_address.empty()) return nullptr;
  Monitored monitored;
  monitored.alive = [&pulse] { return pulse.alive(); };
  monitored.ready = [&metrics] { return metrics.ready(); };
  monitored.metrics = [&metrics] { return metrics.collect(); };
  return Monitor::open(arguments.metrics_address, keys, std::move(monitored));
}

int run(SectorServerArguments& arguments) {
  Waker waker;
  const StopSignals signals([&] { waker.wake(); });
  const absl::StatusOr<std::optional<ServerKeys>> keys =
      open_locks(arguments.keys, kDaemonFolder, {arguments.listen, arguments.metrics_address});
  if (!keys.ok()) {
    log_error(keys.status().message());
    return 1;
  }
  if (absl::Status status = lock_bus(arguments.keys, *keys, arguments.dds.network); !status.ok()) {
    log_error(status.message());
    return 1;
  }
  arguments.dds.self = drawn_node();
  absl::StatusOr<std::unique_ptr<DdsLink>> link = DdsLink::create(arguments.dds);
  if (!link.ok()) {
    log_error(absl::StrCat("cannot join the network of the cluster: ", link.status().message()));
    return 1;
  }
  Streams streams(arguments.dds.self, [&] { waker.wake(); });
  grpc::ServerBuilder builder;
  limit_clients(builder, static_cast<int>(kStreamsMax + kThreadsBesideStreams));
  absl::StatusOr<std::unique_ptr<GrpcDoor>> door =
      GrpcDoor::open(arguments.listen, *keys, client_connections_max(raise_open_files_max()), builder);
  if (!door.ok()) {
    log_error(door.status().message());
    return 1;
  }
  builder.RegisterService(&streams);
  const std::unique_ptr<grpc::Server> edge = builder.BuildAndStart();
  if (!edge) {
    log_error("the server of gRPC could not be started");
    return 1;
  }
  arguments.server.stream_address = (*door)->address();
  (*door)->let_in();
  arguments.server.peak_rss_bytes = [] { return peak_rss_bytes(getpid()); };
  arguments.server.on_load = [&streams](const v1::LoadWorld& load) { streams.begin_world(load); };
  arguments.server.on_new_servers = [&streams](const NewServers& servers) {
    streams.change_servers(servers);
  };
  arguments.server.on_left = [&streams] { streams.end_world(); };
  arguments.server.changed_subscriptions = [&streams] { return streams.changed_subscriptions(); };
  arguments.server.log = write_log;
  TileStore::of_process().set_options(arguments.ground);
  use_tile_folders();

  ServerMetrics metrics(arguments);
  Pulse pulse;
  const absl::StatusOr<std::unique_ptr<Monitor>> monitor = open_monitor(arguments, *keys, metrics, pulse);
  if (!monitor.ok()) {
    log_error(monitor.status().message());
    return 1;
  }
  std::unique_ptr<SectorServer> server;
  const auto on_tick = [&](Tick tick, TickMachine& machine) {
    metrics.show(server->last_tick(), body_count(machine.partition()), server->traffic());
    const TileStore::Counts tiles = TileStore::of_process().counts();
    metrics.show_ground(tiles.tiles, tiles.bytes, tiles.waits);
    streams.publish(tick, machine, false);
  };
  server = std::make_unique<SectorServer>(arguments.server, load_engine, since_start, on_tick);
  waker.attach(link->get());
  log_info(absl::StrCat("node ", absl::Hex(arguments.dds.self.value), " of cluster ", arguments.dds.cluster,
                        ", engine ", name_of(arguments.server.precision), ", streams on ",
                        arguments.server.stream_address));
  if (*monitor) log_info(absl::StrCat("metrics on ", (*monitor)->url(), "metrics"));

  const absl::Status status = serve(**link, *server, streams, metrics, signals, pulse);
  streams.shut_down();
  door->reset();
  edge->Shutdown(std::chrono::system_clock::now() + kFarewell);
  waker.detach();
  if (!status.ok()) {
    log_error(status.message());
    return 1;
  }
  write_log({.tick = server->tick(), .text = "ended"});
  return 0;
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
  tessera::SectorServerArguments arguments;
  const pid_t parent = getppid();
  if (const std::optional<int> code = tessera::read_arguments(argc, argv, arguments)) return *code;
  tessera::keep_freed_memory();
  if (arguments.exit_with_parent && !tessera::end_with_parent(parent, SIGKILL)) return 1;
  tessera::start_log("sector-server", arguments.log);
  return tessera::run(arguments);
}
