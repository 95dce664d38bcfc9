#include "coordinator/process.h"

#include <absl/strings/str_cat.h>

#include <chrono>
#include <cstdio>
#include <utility>
#include <variant>

#include "coordinator/limits.h"
#include "coordinator/metrics.h"
#include "coordinator/server_watch.h"
#include "daemon/log.h"
#include "daemon/ready_file.h"
#include "keys/keys_folder.h"
#include "proto/status.h"

namespace tessera {
namespace {

constexpr std::chrono::milliseconds kStandbyTurn{20};

}  // namespace

absl::StatusOr<std::optional<ServerKeys>> lock_doors(CoordinatorArguments& arguments) {
  absl::StatusOr<std::optional<ServerKeys>> keys =
      open_locks(arguments.keys, kDaemonFolder, {arguments.listen, arguments.metrics_address});
  if (!keys.ok()) return keys.status();
  if (absl::Status status = lock_bus(arguments.keys, *keys, arguments.dds.network); !status.ok())
    return status;
  return keys;
}

Nanoseconds steady_time() { return std::chrono::steady_clock::now().time_since_epoch(); }

CoordinatorProcess::CoordinatorProcess(const CoordinatorArguments& arguments)
    : arguments_(arguments),
      signals_([this] { wake(); }),
      queue_([this] { wake(); }, arguments.queued_request_bytes_max) {}

absl::Status CoordinatorProcess::open(const std::optional<ServerKeys>& keys, grpc::Service* beside) {
  absl::StatusOr<std::unique_ptr<ClientEdge>> edge =
      ClientEdge::open(arguments_.listen, keys, queue_, beside);
  if (!edge.ok()) return edge.status();
  edge_ = *std::move(edge);
  return open_monitor(keys);
}

// The monitor calls these on its own threads.
absl::Status CoordinatorProcess::open_monitor(const std::optional<ServerKeys>& keys) {
  if (arguments_.metrics_address.empty()) return absl::OkStatus();
  Monitored monitored;
  monitored.alive = [this] { return pulse_.alive(); };
  monitored.ready = [this]() -> absl::Status {
    const absl::StatusOr<CoordinatorFigures> figures = ask_for_figures(queue_, coordinator_);
    return figures.ok() ? ready_for_worlds(figures->status, arguments_.coordinator.servers_wanted,
                                           arguments_.coordinator.required_labels)
                        : figures.status();
  };
  monitored.metrics = [this]() -> absl::StatusOr<std::vector<prometheus::MetricFamily>> {
    const absl::StatusOr<CoordinatorFigures> figures = ask_for_figures(queue_, coordinator_);
    if (figures.ok()) return metrics_of(*figures, arguments_.dds.cluster);
    if (!arguments_.etcd.empty()) return standby_metrics(arguments_.dds.cluster);
    return figures.status();
  };
  absl::StatusOr<std::unique_ptr<Monitor>> monitor =
      Monitor::open(arguments_.metrics_address, keys, std::move(monitored));
  if (!monitor.ok()) return monitor.status();
  monitor_ = *std::move(monitor);
  return absl::OkStatus();
}

absl::Status CoordinatorProcess::say_ready() {
  if (!arguments_.ready_file.empty()) {
    if (absl::Status status = write_ready_file(arguments_.ready_file, address()); !status.ok()) return status;
  }
  log_info(absl::StrCat("cluster ", arguments_.dds.cluster, ", domain ", arguments_.dds.domain,
                        ", clients on ", address()));
  if (monitor_) log_info(absl::StrCat("metrics on ", monitor_->url(), "metrics"));
  return absl::OkStatus();
}

void CoordinatorProcess::close() {
  queue_.close();
  refuse_clients(stands_by_error("the coordinator is shutting down"));
  edge_->close();
  if (!arguments_.ready_file.empty()) std::remove(arguments_.ready_file.c_str());
}

void CoordinatorProcess::wake() {
  waker_.wake();
  const std::lock_guard lock(mutex_);
  is_woken_ = true;
  woken_.notify_all();
}

void CoordinatorProcess::wait() {
  pulse_.beat();
  std::unique_lock lock(mutex_);
  woken_.wait_for(lock, kStandbyTurn, [&] { return is_woken_; });
  is_woken_ = false;
}

void CoordinatorProcess::refuse_clients(const absl::Status& status) {
  for (ClientRequest& request : queue_.take()) {
    std::visit([&](auto& call) { call.reply(status, {}); }, request);
  }
}

// Clients that ask for much wait for the next turn, and ticks do not wait for them.
void CoordinatorProcess::take_requests(Coordinator& coordinator, Nanoseconds now) {
  const auto until = std::chrono::steady_clock::now() + kRequestsTurnMax;
  bool is_first = true;
  coordinator.handle(
      [&]() -> std::optional<ClientRequest> {
        if (!std::exchange(is_first, false) && std::chrono::steady_clock::now() >= until) return std::nullopt;
        return queue_.take_next();
      },
      now);
}

bool CoordinatorProcess::serve(Coordinator& coordinator, DdsLink& link, const std::function<bool()>& leads) {
  using Clock = std::chrono::steady_clock;
  ServerWatch watch([this] { wake(); });
  waker_.attach(&link);
  coordinator_ = &coordinator;
  const Clock::time_point start = Clock::now();
  const auto now = [&] { return Nanoseconds(Clock::now() - start); };
  const auto send = [&] {
    for (OutgoingMessage& outgoing : coordinator.take_messages()) {
      std::string payload = outgoing.message.SerializeAsString();
      outgoing.message = v1::ClusterMessage();  // a world is given back before the link needs as much again
      link.send(outgoing.to, std::move(payload));
    }
  };
  while (!coordinator.finished() && leads()) {
    pulse_.beat();
    if (signals_.wanted()) coordinator.retire();
    take_requests(coordinator, now());
    send();
    if (coordinator.finished()) break;
    const Nanoseconds deadline =
        queue_.is_empty() ? coordinator.next_deadline().value_or(now() + std::chrono::seconds(1)) : now();
    for (const Delivery& delivery :
         link.receive(start + std::chrono::duration_cast<Clock::duration>(deadline))) {
      v1::ClusterMessage message;
      if (message.ParseFromString(delivery.payload)) {
        coordinator.receive(delivery.from, std::move(message), now());
      } else {
        log_warning(absl::StrCat("a message from node ", absl::Hex(delivery.from.value), " cannot be read"));
      }
    }
    for (const NodeId node : link.take_lost_peers()) {
      if (!coordinator.suspect(node, now())) link.forget(node);
    }
    for (const NodeId node : watch.take_ended()) coordinator.ended(node, now());
    watch.follow(coordinator.server_addresses());
    coordinator.advance(now());
    if (leads()) send();
  }
  const bool has_finished = coordinator.finished();
  if (!has_finished) coordinator.abandon();
  waker_.detach();
  coordinator_ = nullptr;
  return has_finished;
}

}  // namespace tessera
