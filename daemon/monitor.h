// The HTTP endpoints of a daemon: its metrics, and whether it is alive and ready.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <prometheus/metric_family.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/http_door.h"
#include "keys/gate.h"

class CivetServer;

namespace tessera {

// The heartbeat of a loop that should run at least every second.
class Pulse {
 public:
  Pulse() { beat(); }

  void beat() { last_ = std::chrono::steady_clock::now(); }
  // UNAVAILABLE once the loop has been blocked for longer than it takes to load the largest world.
  absl::Status alive() const;

 private:
  std::atomic<std::chrono::steady_clock::time_point> last_;
};

// Called on threads of the server.
struct Monitored {
  std::function<absl::StatusOr<std::vector<prometheus::MetricFamily>>()> metrics;
  std::function<absl::Status()> alive;
  std::function<absl::Status()> ready;
};

class Monitor {
 public:
  // Serves on `address` (host:port; port 0: any free port), until it is destroyed:
  //   /metrics  Prometheus text format: the metrics of `monitored` and of this process
  //   /healthz  200 while alive, otherwise 503 with the reason
  //   /readyz   200 while ready, likewise
  // With keys, over TLS, and /metrics for who shows a token (Authorization: Bearer TOKEN); 401 for others.
  // Probes need none. INVALID_ARGUMENT for a malformed address, UNAVAILABLE for one that cannot be bound.
  static absl::StatusOr<std::unique_ptr<Monitor>> open(const std::string& address,
                                                       const std::optional<ServerKeys>& keys,
                                                       Monitored monitored);

  ~Monitor();

  // The address it listens on, with the actual port.
  const std::string& address() const { return door_->address(); }
  // "http://127.0.0.1:9464/"
  std::string url() const;

 private:
  class Handler;

  Monitor();

  std::vector<std::unique_ptr<Handler>> handlers_;  // outlive the server
  std::unique_ptr<CivetServer> server_;
  std::unique_ptr<HttpDoor> door_;  // in front of the server
  bool is_locked_ = false;          // by keys
};

}  // namespace tessera
