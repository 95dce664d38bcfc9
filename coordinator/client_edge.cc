#include "coordinator/client_edge.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>
#include <utility>

#include "coordinator/limits.h"
#include "daemon/address.h"
#include "proto/grpc_limits.h"

namespace tessera {
namespace {

constexpr std::chrono::seconds kFarewell{1};
constexpr int kClientThreadsMax = 64;  // of gRPC: calls wait for their replies without one

// gRPC does not report why it cannot bind an address, so ask the system.
std::string why_not(const ListenAddress& endpoint) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  addrinfo* found = nullptr;
  if (const int error =
          getaddrinfo(endpoint.host.c_str(), absl::StrCat(endpoint.port).c_str(), &hints, &found);
      error != 0) {
    return gai_strerror(error);
  }
  const absl::Cleanup free_found = [found] { freeaddrinfo(found); };
  const int fd = socket(found->ai_family, found->ai_socktype, found->ai_protocol);
  if (fd < 0) return std::strerror(errno);
  const absl::Cleanup close_fd = [fd] { ::close(fd); };
  const int yes = 1;
  setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (bind(fd, found->ai_addr, found->ai_addrlen) != 0) return std::strerror(errno);
  if (listen(fd, 1) != 0) return std::strerror(errno);
  return "the server could not be started";
}

}  // namespace

absl::StatusOr<std::unique_ptr<ClientEdge>> ClientEdge::open(const std::string& listen,
                                                             const std::optional<ServerKeys>& keys,
                                                             RequestQueue& queue, grpc::Service* beside) {
  const std::optional<ListenAddress> endpoint = parse_listen_address(listen);
  if (!endpoint) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", listen, "' is not a valid address: use host:port with a port of 0 to 65535"));
  }
  std::unique_ptr<ClientEdge> edge(new ClientEdge(queue, keys ? std::optional(keys->tokens) : std::nullopt));
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  limit_clients(builder, kClientThreadsMax);
  builder.SetMaxReceiveMessageSize(kClientMessageBytesMax);
  builder.SetMaxSendMessageSize(kClientMessageBytesMax);
  builder.AddListeningPort(listen, server_credentials(keys), &port);
  builder.RegisterService(&edge->service_);
  if (beside != nullptr) builder.RegisterService(beside);
  edge->server_ = builder.BuildAndStart();
  if (!edge->server_ || port == 0) {
    return absl::UnavailableError(absl::StrCat("cannot listen on ", listen, ": ", why_not(*endpoint)));
  }
  edge->address_ = with_port(listen, port);
  return edge;
}

ClientEdge::~ClientEdge() { close(); }

void ClientEdge::close() {
  if (!server_) return;
  server_->Shutdown(std::chrono::system_clock::now() + kFarewell);
  server_->Wait();
  server_.reset();
}

}  // namespace tessera
