// Addresses that daemons listen on, as options name them.
#pragma once

#include <optional>
#include <string>

namespace tessera {

struct ListenAddress {
  std::string host;  // without the brackets of IPv6
  int port = 0;      // 0: any free one
};

// "host:port" or "[host]:port"; nothing for text that is none.
std::optional<ListenAddress> parse_listen_address(const std::string& text);

// `text`, an address, with another port.
std::string with_port(const std::string& text, int port);

}  // namespace tessera
