// tessera-coordinator: the process of a cluster that serves clients, orders commands and grants ticks.
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>

#include "coordinator/client_edge.h"
#include "coordinator/coordinator.h"
#include "coordinator/folder_store.h"
#include "coordinator/metrics.h"
#include "coordinator/options.h"
#include "coordinator/request_queue.h"
#include "coordinator/server_watch.h"
#include "daemon/log.h"
#include "daemon/monitor.h"
#include "daemon/options.h"
#include "daemon/parent_process.h"
#include "daemon/ready_file.h"
#include "daemon/stop_signals.h"
#include "proto/recording_file.h"
#include "transport/dds_link.h"
#include "transport/waker.h"

namespace tessera {
namespace {

std::string text(const absl::Status& status) { return std::string(status.message()); }

// If writing fails, the recording ends and the world continues.
void record(const v1::RecordedInput& input, std::optional<RecordingWriter>& recording) {
  if (!recording) return;
  const absl::Status status = recording->write(input);
  if (status.ok()) return;
  spdlog::error("{}: recording has stopped", text(status));
  recording.reset();
}

// The loop of the one thread that owns link and state machine.
void serve(Coordinator& coordinator, DdsLink& link, RequestQueue& queue, ServerWatch& watch,
           const StopSignals& signals, Pulse& pulse) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  const auto now = [&] { return Nanoseconds(Clock::now() - start); };
  const auto send = [&] {
    for (const OutgoingMessage& outgoing : coordinator.take_messages()) {
      link.send(outgoing.to, outgoing.message.SerializeAsString());
    }
  };
  while (!coordinator.finished()) {
    pulse.beat();
    if (signals.wanted()) coordinator.retire();
    for (ClientRequest& request : queue.take()) coordinator.handle(std::move(request), now());
    send();
    if (coordinator.finished()) break;
    const Nanoseconds deadline = coordinator.next_deadline().value_or(now() + std::chrono::seconds(1));
    for (const Delivery& delivery :
         link.receive(start + std::chrono::duration_cast<Clock::duration>(deadline))) {
      v1::ClusterMessage message;
      if (message.ParseFromString(delivery.payload)) {
        coordinator.receive(delivery.from, message, now());
      } else {
        spdlog::warn("a message from node {:x} cannot be read", delivery.from.value);
      }
    }
    for (const NodeId node : link.take_lost_peers()) {
      if (!coordinator.suspect(node, now())) link.forget(node);
    }
    for (const NodeId node : watch.take_ended()) coordinator.ended(node, now());
    watch.follow(coordinator.server_addresses());
    coordinator.advance(now());
    send();
  }
  queue.close();
  for (ClientRequest& request : queue.take()) coordinator.handle(std::move(request), now());
}

// The monitor calls these on its own threads. Null if metrics are off.
absl::StatusOr<std::unique_ptr<Monitor>> open_monitor(const CoordinatorArguments& arguments,
                                                      RequestQueue& queue, const Coordinator& coordinator,
                                                      const Pulse& pulse) {
  if (arguments.metrics_address.empty()) return nullptr;
  Monitored monitored;
  monitored.alive = [&pulse] { return pulse.alive(); };
  monitored.ready = [&]() -> absl::Status {
    const absl::StatusOr<CoordinatorFigures> figures = ask_for_figures(queue, coordinator);
    return figures.ok() ? ready_for_worlds(figures->status, arguments.coordinator.servers_wanted)
                        : figures.status();
  };
  monitored.metrics = [&]() -> absl::StatusOr<std::vector<prometheus::MetricFamily>> {
    const absl::StatusOr<CoordinatorFigures> figures = ask_for_figures(queue, coordinator);
    if (!figures.ok()) return figures.status();
    return metrics_of(*figures, arguments.dds.cluster);
  };
  return Monitor::open(arguments.metrics_address, std::move(monitored));
}

int run(CoordinatorArguments& arguments) {
  Waker waker;
  const StopSignals signals([&] { waker.wake(); });
  RequestQueue queue([&] { waker.wake(); });
  const absl::StatusOr<std::unique_ptr<ClientEdge>> edge = ClientEdge::open(arguments.listen, queue);
  if (!edge.ok()) {
    spdlog::error("{}", text(edge.status()));
    return 1;
  }
  absl::StatusOr<std::unique_ptr<DdsLink>> link = DdsLink::create(arguments.dds);
  if (!link.ok()) {
    spdlog::error("cannot join the network of the cluster: {}", text(link.status()));
    return 1;
  }
  arguments.coordinator.log = write_log;
  std::optional<RecordingWriter> recording;
  if (!arguments.record_inputs.empty()) {
    absl::StatusOr<RecordingWriter> writer = RecordingWriter::create(arguments.record_inputs);
    if (!writer.ok()) {
      spdlog::error("{}", text(writer.status()));
      return 1;
    }
    recording = *std::move(writer);
    arguments.coordinator.inputs = [&recording](const v1::RecordedInput& input) { record(input, recording); };
  }
  arguments.coordinator.worlds_before = static_cast<std::uint64_t>(
      std::chrono::system_clock::now().time_since_epoch() / std::chrono::milliseconds(1));
  std::unique_ptr<WorldStore> store;
  if (!arguments.store.empty()) {
    if (arguments.coordinator.checkpoint_every == Nanoseconds::zero()) {
      spdlog::error("--store needs --checkpoint-every above 0");
      return 1;
    }
    absl::StatusOr<std::unique_ptr<WorldStore>> opened = open_folder_store(arguments.store);
    if (!opened.ok()) {
      spdlog::error("{}", text(opened.status()));
      return 1;
    }
    store = *std::move(opened);
    arguments.coordinator.store = store.get();
  }
  Coordinator coordinator(arguments.coordinator);
  if (absl::Status status = coordinator.resume_stored(); !status.ok()) {
    spdlog::error("{}: {}", arguments.store, text(status));
    return 1;
  }
  Pulse pulse;
  const absl::StatusOr<std::unique_ptr<Monitor>> monitor = open_monitor(arguments, queue, coordinator, pulse);
  if (!monitor.ok()) {
    spdlog::error("{}", text(monitor.status()));
    return 1;
  }
  ServerWatch watch([&] { waker.wake(); });
  const std::string& address = (*edge)->address();
  if (absl::Status status = (*link)->announce_coordinator(address); !status.ok()) {
    spdlog::error("{}", text(status));
    return 1;
  }
  if (!arguments.ready_file.empty()) {
    if (absl::Status status = write_ready_file(arguments.ready_file, address); !status.ok()) {
      spdlog::error("{}", text(status));
      return 1;
    }
  }
  spdlog::info("cluster {}, domain {}, clients on {}", arguments.dds.cluster, arguments.dds.domain, address);
  if (*monitor) spdlog::info("metrics on http://{}/metrics", (*monitor)->address());
  waker.attach(link->get());
  serve(coordinator, **link, queue, watch, signals, pulse);
  waker.detach();
  (*edge)->close();
  if (!arguments.ready_file.empty()) std::remove(arguments.ready_file.c_str());
  return 0;
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
  tessera::CoordinatorArguments arguments;
  const pid_t parent = getppid();
  CLI::App app("Coordinates the sector servers of a cluster, and serves its clients.",
               tessera::kCoordinatorName);
  tessera::add_options(app, arguments);
  if (const std::optional<int> code = tessera::parse_arguments(app, argc, argv)) return *code;
  if (arguments.exit_with_parent && !tessera::end_with_parent(parent, SIGTERM)) return 1;
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);  // failures are reported by us
  tessera::start_log("coordinator", arguments.log);
  return tessera::run(arguments);
}
