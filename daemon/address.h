// Addresses that daemons listen on, as given in options.
#pragma once

#include <optional>
#include <string>

namespace tessera {

struct ListenAddress {
  std::string host;  // without the brackets of IPv6
  int port = 0;      // 0: any free port
};

// "host:port" or "[host]:port"; nullopt for any other text.
std::optional<ListenAddress> parse_listen_address(const std::string& text);

// Whether only this machine reaches `address`: 127.0.0.0/8, ::1 or localhost. False for any other name.
bool is_loopback(const ListenAddress& address);

// `text`, an address, with another port.
std::string with_port(const std::string& text, int port);

}  // namespace tessera
