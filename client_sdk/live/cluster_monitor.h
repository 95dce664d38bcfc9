// The state of the cluster, polled a few times a second.
#pragma once

#include <absl/status/status.h>
#include <absl/time/time.h>

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "tessera/client.h"

namespace tessera::live {

struct ClusterReport {
  absl::Status answer = absl::UnavailableError("the cluster has not been asked yet");
  ClusterStatus cluster;             // from its last answer
  std::uint64_t world = 0;           // changes with every load of a world
  std::vector<std::uint64_t> nodes;  // of all servers seen so far, in order of appearance

  // Whether a world was loaded at the last answer.
  bool is_live() const {
    return cluster.state == "paused" || cluster.state == "running" || cluster.state == "recovering";
  }
};

class ClusterMonitor {
 public:
  using Listener = std::function<void(const std::shared_ptr<const ClusterReport>&)>;

  // Calls `listener`, on a thread of its own, with every report.
  ClusterMonitor(Client& client, absl::Duration period, Listener listener);
  ~ClusterMonitor();

  std::shared_ptr<const ClusterReport> latest() const;

 private:
  void run();

  Client& client_;
  const absl::Duration period_;
  const Listener listener_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::shared_ptr<const ClusterReport> latest_ = std::make_shared<ClusterReport>();
  bool closing_ = false;
  std::thread thread_;
};

}  // namespace tessera::live
