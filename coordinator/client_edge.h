// The address at which clients reach the coordinator: a gRPC server.
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "coordinator/request_queue.h"
#include "coordinator/service.h"
#include "daemon/grpc_door.h"
#include "keys/gate.h"

namespace tessera {

class ClientEdge {
 public:
  // Serves the service Tessera on `listen` ("host:port"; port 0: any free one), and `beside`, if there is
  // one, to those whom `keys` names; to everyone without. `queue` and `beside` must outlive it.
  // INVALID_ARGUMENT for a malformed address; UNAVAILABLE, with the reason, for an address that is in use or
  // does not belong to this machine.
  static absl::StatusOr<std::unique_ptr<ClientEdge>> open(const std::string& listen,
                                                          const std::optional<ServerKeys>& keys,
                                                          RequestQueue& queue,
                                                          grpc::Service* beside = nullptr);

  ~ClientEdge();

  // The address it listens on, with the actual port.
  const std::string& address() const { return address_; }

  // Refuses new calls, gives answered calls a moment to finish, and cancels the rest.
  void close();

 private:
  ClientEdge(RequestQueue& queue, std::optional<Tokens> tokens) : service_(queue, std::move(tokens)) {}

  TesseraService service_;
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<GrpcDoor> door_;  // in front of the server
  std::string address_;
};

}  // namespace tessera
