#include "coordinator/client_edge.h"

#include <chrono>
#include <optional>
#include <utility>

#include "coordinator/limits.h"
#include "daemon/open_files.h"
#include "proto/grpc_limits.h"

namespace tessera {
namespace {

constexpr std::chrono::seconds kFarewell{1};
constexpr int kClientThreadsMax = 64;  // of gRPC: calls wait for their replies without one

}  // namespace

absl::StatusOr<std::unique_ptr<ClientEdge>> ClientEdge::open(const std::string& listen,
                                                             const std::optional<ServerKeys>& keys,
                                                             RequestQueue& queue, grpc::Service* beside) {
  std::unique_ptr<ClientEdge> edge(new ClientEdge(queue, keys ? std::optional(keys->tokens) : std::nullopt));
  grpc::ServerBuilder builder;
  limit_clients(builder, kClientThreadsMax);
  builder.SetMaxReceiveMessageSize(kClientMessageBytesMax);
  builder.SetMaxSendMessageSize(kClientMessageBytesMax);
  absl::StatusOr<std::unique_ptr<GrpcDoor>> door =
      GrpcDoor::open(listen, keys, client_connections_max(raise_open_files_max()), builder);
  if (!door.ok()) return door.status();
  edge->door_ = *std::move(door);
  builder.RegisterService(&edge->service_);
  if (beside != nullptr) builder.RegisterService(beside);
  edge->server_ = builder.BuildAndStart();
  if (!edge->server_) return absl::UnavailableError("the server of gRPC could not be started");
  edge->address_ = edge->door_->address();
  edge->door_->let_in();
  return edge;
}

ClientEdge::~ClientEdge() { close(); }

void ClientEdge::close() {
  if (!server_) return;
  door_.reset();
  server_->Shutdown(std::chrono::system_clock::now() + kFarewell);
  server_->Wait();
  server_.reset();
}

}  // namespace tessera
