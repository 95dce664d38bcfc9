// Accepts the connections of a server of gRPC, which has no bound for them itself: without descriptors, it
// would never accept one again.
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/server_builder.h>

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "keys/gate.h"

namespace tessera {

// Connections of all clients, and half of them of an address; further ones are closed at once. Fewer where
// the process may have fewer files open.
inline constexpr std::size_t kClientConnectionsMax = 16'384;
// What is left for the process itself: its store, its network, its other doors.
inline constexpr std::size_t kOwnFilesMax = 1024;

// How many connections a process may have that may have so many files open.
std::size_t client_connections_max(std::size_t open_files_max);

class GrpcDoor {
 public:
  // Listens on `address` (host:port; port 0: any free one) for the server that `builder` makes, with TLS if
  // there are keys. INVALID_ARGUMENT for what is no address; UNAVAILABLE for one that cannot be bound.
  static absl::StatusOr<std::unique_ptr<GrpcDoor>> open(const std::string& address,
                                                        const std::optional<ServerKeys>& keys,
                                                        std::size_t connections_max,
                                                        grpc::ServerBuilder& builder);
  // Lets nobody in any more. To be called before the server ends.
  ~GrpcDoor();

  // With the actual port.
  const std::string& address() const;

  // Once the server runs.
  void let_in();

 private:
  class Impl;
  explicit GrpcDoor(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
