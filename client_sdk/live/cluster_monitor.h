// How the cluster is, asked a few times a second.
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
  ClusterStatus cluster;             // as it was when it last answered
  std::uint64_t world = 0;           // another number whenever there is another world, or the same anew
  std::vector<std::uint64_t> nodes;  // of all servers ever seen, in the order of their coming

  // Whether there is a world, as far as is known.
  bool is_live() const { return cluster.state == "paused" || cluster.state == "running"; }
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
