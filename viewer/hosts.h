// The names under which a browser may ask for the web UI.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tessera::viewer {

// A site may let its own name lead to this machine (DNS rebinding), and would then count as the web UI
// itself. So only names that no stranger can give are accepted: IP addresses, "localhost", the name of this
// machine, and those that are listed.
class Hosts {
 public:
  explicit Hosts(std::vector<std::string> names);

  // `host` as in an HTTP request: with or without a port, in any case.
  bool allows(std::string_view host) const;

 private:
  std::vector<std::string> names_;  // in lower case
};

}  // namespace tessera::viewer
