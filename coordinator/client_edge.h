// Where clients reach the coordinator: a gRPC server on one address.
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>

#include "coordinator/request_queue.h"
#include "coordinator/service.h"

namespace tessera {

class ClientEdge {
 public:
  // Serves the service Tessera on `listen` ("host:port"; port 0: any free one). `queue` must outlive it.
  // INVALID_ARGUMENT for an address that is none, UNAVAILABLE, with the reason, for one that cannot be had:
  // in use, or not of this machine.
  static absl::StatusOr<std::unique_ptr<ClientEdge>> open(const std::string& listen, RequestQueue& queue);

  ~ClientEdge();

  // Where it listens, with the port that it got.
  const std::string& address() const { return address_; }

  // Takes no new calls, and gives those that were answered a moment to leave; cancels the rest.
  void close();

 private:
  explicit ClientEdge(RequestQueue& queue) : service_(queue) {}

  TesseraService service_;
  std::unique_ptr<grpc::Server> server_;
  std::string address_;
};

}  // namespace tessera
