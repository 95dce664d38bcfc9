// What strangers come to first, in front of a server of HTTP.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "keys/gate.h"

namespace tessera {

// Where the server behind a door listens: on loopback, at any free port.
inline constexpr const char* kBehindDoor = "127.0.0.1:0";

// Connections whose clients have sent no request yet: of all, and of an address (an IPv6 network of 64 bits).
// For one that is too many, the oldest of them is closed.
inline constexpr std::size_t kWaitingClientsMax = 256;
inline constexpr std::size_t kWaitingClientsPerHostMax = 64;
// Connections that the server has; further requests wait.
inline constexpr std::size_t kServedClientsMax = 256;

// The server has a thread for each connection. So it gets one only once there is a whole request, for which a
// client has kRequestMax (door_relay.h). One that breaks the protocol is disconnected. With keys, the door
// also speaks TLS. (CivetWeb has TLS of its own, but Debian's ends the process with OpenSSL 3.)
class HttpDoor {
 public:
  // Listens on `address` (host:port; port 0: any free one) until it is destroyed, and carries what clients
  // send to `port` of loopback and back. INVALID_ARGUMENT for keys that OpenSSL does not take; UNAVAILABLE
  // for an address that cannot be bound.
  static absl::StatusOr<std::unique_ptr<HttpDoor>> open(const std::string& address, int port,
                                                        const std::optional<ServerKeys>& keys);
  ~HttpDoor();

  // The address it listens on, with the actual port.
  const std::string& address() const;

 private:
  class Impl;
  explicit HttpDoor(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
