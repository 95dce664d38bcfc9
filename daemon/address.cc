#include "daemon/address.h"

#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <arpa/inet.h>

namespace tessera {
namespace {

constexpr int kPortMax = 65'535;

}  // namespace

std::optional<ListenAddress> parse_listen_address(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) return std::nullopt;
  ListenAddress address;
  if (!absl::SimpleAtoi(text.substr(colon + 1), &address.port)) return std::nullopt;
  if (address.port < 0 || address.port > kPortMax) return std::nullopt;
  address.host = text.substr(0, colon);
  if (address.host.front() == '[' && address.host.back() == ']') {
    address.host = address.host.substr(1, address.host.size() - 2);
  }
  return address;
}

bool is_loopback(const ListenAddress& address) {
  constexpr std::uint32_t kNet = 127;
  in_addr v4{};
  if (inet_pton(AF_INET, address.host.c_str(), &v4) == 1) return ntohl(v4.s_addr) >> 24 == kNet;
  in6_addr v6{};
  if (inet_pton(AF_INET6, address.host.c_str(), &v6) == 1) return IN6_IS_ADDR_LOOPBACK(&v6) != 0;
  return absl::EqualsIgnoreCase(address.host, "localhost");
}

std::string with_port(const std::string& text, int port) {
  return absl::StrCat(text.substr(0, text.rfind(':')), ":", port);
}

}  // namespace tessera
