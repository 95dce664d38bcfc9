// Serves the web UI over HTTP and its data over WebSockets: "/" the web UI, "/status" the state of the
// cluster as JSON, "/live" a WebSocket for every open tab.
#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <optional>
#include <string>

#include "keys/gate.h"
#include "tessera/client.h"
#include "viewer/hosts.h"
#include "viewer/page_session.h"

namespace tessera::viewer {

class WebServer {
 public:
  // Listens on `address`, host:port; port 0: any free port. Requests under other names than `hosts` are
  // refused. With keys, over TLS, and only for browsers that have shown a token: one of role observe may only
  // look. UNAVAILABLE if the address cannot be bound.
  static absl::StatusOr<std::unique_ptr<WebServer>> open(const std::string& address, Hosts hosts,
                                                         const std::optional<ServerKeys>& keys,
                                                         Client& client, const PageOptions& options);
  ~WebServer();

  // "http://127.0.0.1:7380/"
  const std::string& url() const;

 private:
  class Impl;
  explicit WebServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::viewer
