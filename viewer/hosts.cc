#include "viewer/hosts.h"

#include <absl/strings/ascii.h>
#include <arpa/inet.h>
#include <unistd.h>

#include <algorithm>
#include <climits>
#include <utility>

namespace tessera::viewer {
namespace {

bool is_address(const std::string& host) {
  in_addr v4{};
  if (inet_pton(AF_INET, host.c_str(), &v4) == 1) return true;
  if (host.size() < 2 || host.front() != '[' || host.back() != ']') return false;
  in6_addr v6{};
  return inet_pton(AF_INET6, host.substr(1, host.size() - 2).c_str(), &v6) == 1;
}

}  // namespace

Hosts::Hosts(std::vector<std::string> names) : names_(std::move(names)) {
  names_.emplace_back("localhost");
  char own[HOST_NAME_MAX + 1] = "";
  if (gethostname(own, HOST_NAME_MAX) == 0 && own[0] != '\0') names_.emplace_back(own);
  for (std::string& name : names_) absl::AsciiStrToLower(&name);
}

bool Hosts::allows(std::string_view host) const {
  const std::size_t colon = host.rfind(':');
  const std::size_t bracket = host.rfind(']');
  const bool has_port =
      colon != std::string_view::npos && (bracket == std::string_view::npos || colon > bracket);
  std::string name(has_port ? host.substr(0, colon) : host);
  absl::AsciiStrToLower(&name);
  return is_address(name) || std::find(names_.begin(), names_.end(), name) != names_.end();
}

}  // namespace tessera::viewer
