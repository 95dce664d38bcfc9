#include "client_sdk/live/cluster_monitor.h"

#include <algorithm>
#include <utility>

namespace tessera::live {
namespace {

constexpr absl::Duration kAnswerTimeout = absl::Seconds(5);

ClusterReport next_report(const ClusterReport& last, absl::StatusOr<ClusterStatus> status) {
  ClusterReport report = last;
  report.answer = status.status();
  if (!status.ok()) return report;
  report.cluster = *std::move(status);
  const bool went_on = last.is_live() && report.is_live() && report.cluster.world == last.cluster.world &&
                       report.cluster.tick >= last.cluster.tick;
  if (!went_on) ++report.world;
  for (const ServerStatus& server : report.cluster.servers) {
    if (std::find(report.nodes.begin(), report.nodes.end(), server.node) == report.nodes.end()) {
      report.nodes.push_back(server.node);
    }
  }
  return report;
}

}  // namespace

ClusterMonitor::ClusterMonitor(Client& client, absl::Duration period, Listener listener)
    : client_(client), period_(period), listener_(std::move(listener)), thread_([this] { run(); }) {}

ClusterMonitor::~ClusterMonitor() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::shared_ptr<const ClusterReport> ClusterMonitor::latest() const {
  const std::lock_guard lock(mutex_);
  return latest_;
}

void ClusterMonitor::run() {
  for (;;) {
    const auto report =
        std::make_shared<const ClusterReport>(next_report(*latest(), client_.status(kAnswerTimeout)));
    {
      const std::lock_guard lock(mutex_);
      latest_ = report;
    }
    listener_(report);
    std::unique_lock lock(mutex_);
    if (changed_.wait_for(lock, absl::ToChronoMilliseconds(period_), [&] { return closing_; })) return;
  }
}

}  // namespace tessera::live
