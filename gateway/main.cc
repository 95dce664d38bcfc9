// tessera-gateway: the one address that clients of a cluster need to reach.
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <grpcpp/grpcpp.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>

#include "daemon/end_signals.h"
#include "daemon/grpc_door.h"
#include "daemon/log.h"
#include "daemon/monitor.h"
#include "daemon/open_files.h"
#include "daemon/parent_process.h"
#include "daemon/ready_file.h"
#include "gateway/gateway_service.h"
#include "gateway/metrics.h"
#include "gateway/options.h"
#include "keys/keys_folder.h"
#include "proto/grpc_limits.h"

namespace tessera {
namespace {

constexpr int kThreadsMax = 64;  // of gRPC: calls wait without one
constexpr std::chrono::seconds kFarewell{1};

struct Locks {
  std::optional<ServerKeys> server;
  ClientKeys client;  // towards the daemons
};

absl::StatusOr<Locks> open_own_locks(const GatewayArguments& arguments) {
  absl::StatusOr<std::optional<ServerKeys>> server =
      open_locks(arguments.keys, kGatewayFolder, {arguments.listen, arguments.metrics_address});
  if (!server.ok()) return server.status();
  if (!*server) return Locks{};
  absl::StatusOr<ClientKeys> client = ClientKeys::read((*server)->folder);
  if (!client.ok()) return client.status();
  return Locks{*std::move(server), *std::move(client)};
}

// Null if metrics are off.
absl::StatusOr<std::unique_ptr<Monitor>> open_monitor(const GatewayArguments& arguments, const Locks& locks,
                                                      const Routes& routes, const Traffic& traffic) {
  if (arguments.metrics_address.empty()) return nullptr;
  Monitored monitored;
  monitored.alive = [] { return absl::OkStatus(); };
  monitored.ready = [&routes] { return routes.ready(); };
  monitored.metrics = [&routes, &traffic, cluster = arguments.dds.cluster] {
    return metrics_of(traffic, routes.ready().ok(), cluster);
  };
  return Monitor::open(arguments.metrics_address, locks.server, std::move(monitored));
}

void log_leader(const absl::StatusOr<std::string>& leader) {
  if (leader.ok()) {
    log_info(absl::StrCat("the coordinator at ", *leader, " leads"));
  } else {
    log_warning(leader.status().message());
  }
}

absl::Status run(const GatewayArguments& arguments) {
  const EndSignals end;
  const absl::StatusOr<Locks> locks = open_own_locks(arguments);
  if (!locks.ok()) return locks.status();
  Traffic traffic(arguments.limits);
  Routes routes(arguments.connect, locks->client, log_leader);
  GatewayService service(routes, traffic, locks->server.has_value());
  grpc::ServerBuilder builder;
  limit_clients(builder, kThreadsMax);
  builder.SetMaxReceiveMessageSize(kGatewayMessageBytesMax);
  builder.SetMaxSendMessageSize(-1);
  absl::StatusOr<std::unique_ptr<GrpcDoor>> door = GrpcDoor::open(
      arguments.listen, locks->server, client_connections_max(raise_open_files_max()), builder);
  if (!door.ok()) return door.status();
  builder.RegisterCallbackGenericService(&service);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  if (!server) return absl::UnavailableError("the server of gRPC could not be started");
  const absl::StatusOr<std::unique_ptr<Monitor>> monitor = open_monitor(arguments, *locks, routes, traffic);
  if (!monitor.ok()) return monitor.status();
  const std::string address = (*door)->address();
  (*door)->let_in();
  if (!arguments.ready_file.empty()) {
    if (absl::Status status = write_ready_file(arguments.ready_file, address); !status.ok()) return status;
  }
  log_info(absl::StrCat("clients on ", address, ", coordinators at ", absl::StrJoin(arguments.connect, ",")));
  if (*monitor) log_info(absl::StrCat("metrics on ", (*monitor)->url(), "metrics"));
  end.wait();
  door->reset();
  server->Shutdown(std::chrono::system_clock::now() + kFarewell);
  server->Wait();
  if (!arguments.ready_file.empty()) std::remove(arguments.ready_file.c_str());
  log_info("ended");
  return absl::OkStatus();
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
  tessera::GatewayArguments arguments;
  const pid_t parent = getppid();
  if (const std::optional<int> code = tessera::read_arguments(argc, argv, arguments)) return *code;
  if (arguments.exit_with_parent && !tessera::end_with_parent(parent, SIGTERM)) return 1;
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);  // failures are reported by us
  tessera::start_log("gateway", arguments.log);
  const absl::Status status = tessera::run(arguments);
  if (!status.ok()) tessera::log_error(status.message());
  return status.ok() ? 0 : 1;
}
