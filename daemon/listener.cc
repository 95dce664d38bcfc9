#include "daemon/listener.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <optional>
#include <utility>

#include "daemon/address.h"

namespace tessera {
namespace {

constexpr int kBacklog = 1024;  // in the system, until a daemon has accepted them

int port_of(const Descriptor& socket) {
  sockaddr_in6 address{};  // ports of both kinds are at the same place
  socklen_t size = sizeof address;
  getsockname(socket.get(), reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin6_port);
}

void set_port(sockaddr& address, int port) {
  const std::uint16_t in_order = htons(static_cast<std::uint16_t>(port));
  if (address.sa_family == AF_INET) reinterpret_cast<sockaddr_in&>(address).sin_port = in_order;
  if (address.sa_family == AF_INET6) reinterpret_cast<sockaddr_in6&>(address).sin6_port = in_order;
}

// Not open if it cannot be bound: errno has the reason.
Descriptor bound_to(const addrinfo& place) {
  Descriptor listener(socket(place.ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int yes = 1;
  setsockopt(listener.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (bind(listener.get(), place.ai_addr, place.ai_addrlen) != 0 || listen(listener.get(), kBacklog) != 0) {
    return Descriptor();
  }
  return listener;
}

std::string host_of(const sockaddr_storage& address) {
  constexpr std::size_t kNetworkBytes = 8;
  if (address.ss_family == AF_INET) {
    const in_addr& v4 = reinterpret_cast<const sockaddr_in&>(address).sin_addr;
    return {reinterpret_cast<const char*>(&v4), sizeof v4};
  }
  const in6_addr& v6 = reinterpret_cast<const sockaddr_in6&>(address).sin6_addr;
  const char* bytes = reinterpret_cast<const char*>(&v6);
  if (IN6_IS_ADDR_V4MAPPED(&v6)) return {bytes + sizeof v6 - sizeof(in_addr), sizeof(in_addr)};
  return {bytes, kNetworkBytes};
}

}  // namespace

absl::StatusOr<Listener> Listener::open(const std::string& address) {
  const std::optional<ListenAddress> place = parse_listen_address(address);
  if (!place) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", address, "' is not a valid address: use host:port with a port of 0 to 65535"));
  }
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(place->host.c_str(), absl::StrCat(place->port).c_str(), &hints, &found);
      error != 0) {
    return absl::UnavailableError(absl::StrCat("cannot listen on ", address, ": ", gai_strerror(error)));
  }
  const absl::Cleanup free_found = [found] { freeaddrinfo(found); };
  Listener listener;
  int error = 0;
  int port = place->port;
  for (const addrinfo* one = found; one != nullptr; one = one->ai_next) {
    set_port(*one->ai_addr, port);
    Descriptor socket = bound_to(*one);
    if (!socket.is_open()) {
      error = errno;
      if (error == EADDRINUSE) break;  // one of several would have clients that are meant for another program
      continue;
    }
    port = port_of(socket);
    listener.sockets_.push_back(std::move(socket));
  }
  if (listener.sockets_.empty() || error == EADDRINUSE) {
    return absl::UnavailableError(absl::StrCat("cannot listen on ", address, ": ", std::strerror(error)));
  }
  listener.address_ = with_port(address, port);
  return listener;
}

Visitor Listener::accept(const Descriptor& socket) {
  sockaddr_storage from{};
  socklen_t size = sizeof from;
  Descriptor client(
      accept4(socket.get(), reinterpret_cast<sockaddr*>(&from), &size, SOCK_NONBLOCK | SOCK_CLOEXEC));
  if (!client.is_open()) return {Descriptor(), {}};
  const int yes = 1;
  setsockopt(client.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  return {std::move(client), host_of(from)};
}

bool Listener::is_shortage(int error) {
  return error == EMFILE || error == ENFILE || error == ENOBUFS || error == ENOMEM;
}

}  // namespace tessera
