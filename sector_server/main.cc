// tessera-sector-server: hosts sectors of a world for a coordinator.
#include <grpcpp/grpcpp.h>
#include <malloc.h>
#include <signal.h>
#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <random>
#include <thread>

#include "lpss/engine/load_engine.h"
#include "proto/peak_memory.h"
#include "sector_server/sector_server.h"
#include "sector_server/streams.h"
#include "transport/dds_link.h"

namespace tessera {
namespace {

std::atomic<Link*> signalled_link = nullptr;
std::atomic<bool> stop_wanted = false;

void on_signal(int) {
  stop_wanted = true;
  if (Link* link = signalled_link) link->wake();
}

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

struct Arguments {
  DdsOptions dds;
  SectorServerOptions server;
  std::string listen = "127.0.0.1:0";
  std::string engine = "f32";
  std::string log_level = "info";
  bool exit_with_parent = false;
};

int parse(int argc, char** argv, Arguments& arguments) {
  CLI::App app("Hosts sectors of a world, and steps them when the coordinator grants ticks.",
               "tessera-sector-server");
  app.footer("Example: tessera-sector-server --cluster lab --engine f32 --threads 4");
  arguments.server.threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  app.add_option("--cluster", arguments.dds.cluster, "Name of the cluster")->capture_default_str();
  app.add_option("--domain", arguments.dds.domain, "DDS domain, 0 to 232")->capture_default_str();
  app.add_option("--engine", arguments.engine, "Precision that it serves")
      ->check(CLI::IsMember({"f32", "f64"}))
      ->capture_default_str();
  app.add_option("--threads", arguments.server.threads, "Threads that step sectors")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  double coordinator_timeout_s = std::chrono::duration<double>(arguments.server.coordinator_timeout).count();
  app.add_option("--coordinator-timeout", coordinator_timeout_s,
                 "Silence after which the coordinator counts as lost, s")
      ->check(CLI::Range(0.1, 1e6))
      ->capture_default_str();
  app.add_option("--listen", arguments.listen, "Address for the streams of clients; port 0: any free one")
      ->capture_default_str();
  app.add_option("--log-level", arguments.log_level, "trace, debug, info, warn, error or off")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
  app.add_flag("--exit-with-parent", arguments.exit_with_parent,
               "End when the process that started this one does");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int code = app.exit(error);
    return code == 0 ? 0 : 2;
  }
  arguments.server.coordinator_timeout =
      std::chrono::duration_cast<Nanoseconds>(std::chrono::duration<double>(coordinator_timeout_s));
  arguments.server.precision = arguments.engine == "f64" ? Precision::kFloat64 : Precision::kFloat32;
  return -1;
}

// One thread owns the link and the state machine; the threads of gRPC only wake it.
absl::Status serve(DdsLink& link, SectorServer& server, Streams& streams) {
  const auto start = std::chrono::steady_clock::now() - since_start();
  server.start(link.self(), since_start());
  while (!server.finished() && !stop_wanted) {
    for (SectorServer::Outgoing& message : server.take_messages())
      link.send(message.to, std::move(message.payload));
    const std::optional<Nanoseconds> deadline = server.next_deadline();
    const auto until = server.work_left()
                           ? std::chrono::steady_clock::time_point{}
                           : start + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                                         deadline.value_or(since_start() + std::chrono::seconds(1)));
    std::vector<Delivery> deliveries = link.receive(until);
    for (const NodeId node : link.take_lost_peers()) server.suspect(node, since_start());
    for (Delivery& delivery : deliveries) {
      v1::ClusterMessage message;
      if (!message.ParseFromString(delivery.payload)) return absl::DataLossError("a message cannot be read");
      server.receive(delivery.from, std::move(message), since_start());
    }
    server.proceed(since_start());
    server.advance(since_start());
    if (Share* share = server.share_between_ticks()) streams.publish(server.tick(), *share, true);
  }
  server.leave("it was told to end");
  for (SectorServer::Outgoing& message : server.take_messages())
    link.send(message.to, std::move(message.payload));
  return server.finished().value_or(absl::OkStatus());
}

int run(Arguments& arguments) {
  arguments.dds.self = drawn_node();
  absl::StatusOr<std::unique_ptr<DdsLink>> link = DdsLink::create(arguments.dds);
  if (!link.ok()) {
    spdlog::error("cannot join the network of the cluster: {}", std::string(link.status().message()));
    return 1;
  }
  Streams streams(arguments.dds.self, [&] { (*link)->wake(); });
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder.AddListeningPort(arguments.listen, grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&streams);
  const std::unique_ptr<grpc::Server> edge = builder.BuildAndStart();
  if (!edge || port == 0) {
    spdlog::error("cannot listen on {}: the address is in use or not of this machine", arguments.listen);
    return 1;
  }
  arguments.server.stream_address =
      arguments.listen.substr(0, arguments.listen.rfind(':')) + ":" + std::to_string(port);
  arguments.server.peak_rss_bytes = [] { return peak_rss_bytes(getpid()); };

  SectorServer server(arguments.server, load_engine, since_start,
                      [&](Tick tick, Share& share) { streams.publish(tick, share, false); });
  signalled_link = link->get();
  struct sigaction action {};
  action.sa_handler = on_signal;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  spdlog::info("node {:x} of cluster {}, engine {}, streams on {}", arguments.dds.self.value,
               arguments.dds.cluster, arguments.engine, arguments.server.stream_address);

  const absl::Status status = serve(**link, server, streams);
  streams.shut_down();
  edge->Shutdown(std::chrono::system_clock::now() + std::chrono::seconds(1));
  signalled_link = nullptr;
  if (!status.ok()) {
    spdlog::error("{}", std::string(status.message()));
    return 1;
  }
  spdlog::info("ended at tick {}", server.tick());
  return 0;
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
  tessera::Arguments arguments;
  if (const int code = tessera::parse(argc, argv, arguments); code >= 0) return code;
  // What a tick frees, the next one wants again: keep it instead of handing it to the kernel and back.
  mallopt(M_TRIM_THRESHOLD, 256 << 20);
  if (arguments.exit_with_parent) prctl(PR_SET_PDEATHSIG, SIGKILL);
  spdlog::set_level(spdlog::level::from_str(arguments.log_level));
  spdlog::set_pattern("%H:%M:%S.%e %^%l%$ sector_server: %v");
  return tessera::run(arguments);
}
