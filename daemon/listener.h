// The sockets of an address at which a daemon waits for connections.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "transport/descriptor.h"

namespace tessera {

// A door accepts so many before it looks after the others.
inline constexpr int kAcceptedAtOnceMax = 64;

struct Visitor {
  Descriptor socket;  // not open if none has come: errno has the reason
  std::string host;   // what connections of one client have in common: an IPv4 address, or an IPv6 network
};

class Listener {
 public:
  // Of host:port; port 0: any free one. A name may have several addresses: at least one has to belong to this
  // machine. INVALID_ARGUMENT for what is no address; UNAVAILABLE, with the reason, for one that cannot be
  // bound.
  static absl::StatusOr<Listener> open(const std::string& address);

  // With the actual port.
  const std::string& address() const { return address_; }
  // To be polled.
  const std::vector<Descriptor>& sockets() const { return sockets_; }
  // A connection that has come to one of them. Never blocks, nor does the socket.
  static Visitor accept(const Descriptor& socket);
  // Whether `error` (errno) means that the system has no descriptors or memory for another one.
  static bool is_shortage(int error);

 private:
  Listener() = default;

  std::vector<Descriptor> sockets_;
  std::string address_;
};

}  // namespace tessera
