// TLS in front of a server that speaks none.
#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <string>

#include "keys/gate.h"

namespace tessera {

// Where the server behind a door listens: on loopback, at any free port.
inline constexpr const char* kBehindDoor = "127.0.0.1:0";

// (CivetWeb has TLS of its own, but Debian's ends the process with OpenSSL 3.) A client that breaks the
// protocol, or does not finish the handshake in time, is disconnected.
class TlsDoor {
 public:
  // Listens on `address` (host:port; port 0: any free one) until it is destroyed, and carries what clients
  // send to `port` of loopback and back. INVALID_ARGUMENT for keys that OpenSSL does not take; UNAVAILABLE
  // for an address that cannot be bound.
  static absl::StatusOr<std::unique_ptr<TlsDoor>> open(const std::string& address, int port,
                                                       const ServerKeys& keys);
  ~TlsDoor();

  // The address it listens on, with the actual port.
  const std::string& address() const;

 private:
  class Impl;
  explicit TlsDoor(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
