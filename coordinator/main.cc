// tessera-coordinator: the one process of a cluster that clients talk to, and that says how far time has
// come.
#include <pthread.h>
#include <signal.h>
#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "coordinator/client_edge.h"
#include "coordinator/coordinator.h"
#include "coordinator/request_queue.h"
#include "lpss/world/limits.h"
#include "transport/dds_link.h"

namespace tessera {
namespace {

struct Arguments {
  DdsOptions dds{.self = kCoordinatorNode};
  CoordinatorOptions coordinator;
  std::string listen = "127.0.0.1:7300";
  std::string ready_file;
  std::string log_level = "info";
  bool exit_with_parent = false;
};

// The exit code of a process that must end now, or nothing.
std::optional<int> parse(int argc, char** argv, Arguments& arguments) {
  CLI::App app("Coordinates the sector servers of a cluster, and serves its clients.", "tessera-coordinator");
  app.footer("Example: tessera-coordinator --cluster lab --servers 2 --listen 127.0.0.1:7300");
  app.add_option("--listen", arguments.listen, "Address for clients, host:port; port 0: any free one")
      ->capture_default_str();
  app.add_option("--cluster", arguments.dds.cluster, "Name of the cluster")->capture_default_str();
  app.add_option("--domain", arguments.dds.domain, "DDS domain, 0 to 232")->capture_default_str();
  app.add_option("--servers", arguments.coordinator.servers_wanted,
                 "Load worlds on this many sector servers of their precision; 0: on all there are")
      ->check(CLI::Range(0u, kServersMax))
      ->capture_default_str();
  double join_timeout_s = std::chrono::duration<double>(arguments.coordinator.join_timeout).count();
  app.add_option("--join-timeout", join_timeout_s, "How long a load waits for sector servers, s")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  double server_timeout_s = std::chrono::duration<double>(arguments.coordinator.server_timeout).count();
  app.add_option("--server-timeout", server_timeout_s,
                 "Silence after which a sector server counts as lost, s")
      ->check(CLI::Range(0.1, 1e6))
      ->capture_default_str();
  app.add_option("--ready-file", arguments.ready_file, "Write the address for clients here once it serves");
  app.add_option("--log-level", arguments.log_level, "trace, debug, info, warn, error or off")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
  app.add_flag("--exit-with-parent", arguments.exit_with_parent,
               "End when the process that started this one does");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const auto nanoseconds = [](double s) {
    return std::chrono::duration_cast<Nanoseconds>(std::chrono::duration<double>(s));
  };
  arguments.coordinator.join_timeout = nanoseconds(join_timeout_s);
  arguments.coordinator.server_timeout = nanoseconds(server_timeout_s);
  return std::nullopt;
}

// Turns SIGINT and SIGTERM into a flag and a call. Must be made before any other thread is, so that no other
// thread takes the signals.
class StopSignals {
 public:
  explicit StopSignals(std::function<void()> on_stop) : on_stop_(std::move(on_stop)) {
    sigemptyset(&set_);
    sigaddset(&set_, SIGINT);
    sigaddset(&set_, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &set_, nullptr);
    thread_ = std::thread([this] {
      int signal = 0;
      sigwait(&set_, &signal);
      wanted_ = true;
      on_stop_();
    });
  }
  ~StopSignals() {
    pthread_kill(thread_.native_handle(), SIGTERM);  // ends the wait, if it still waits
    thread_.join();
  }

  bool wanted() const { return wanted_; }

 private:
  std::function<void()> on_stop_;
  sigset_t set_{};
  std::atomic<bool> wanted_ = false;
  std::thread thread_;
};

// A link that other threads may wake as soon as it is there.
class Waker {
 public:
  void attach(Link* link) {
    const std::lock_guard lock(mutex_);
    link_ = link;
  }
  void wake() {
    const std::lock_guard lock(mutex_);
    if (link_ != nullptr) link_->wake();
  }

 private:
  std::mutex mutex_;
  Link* link_ = nullptr;
};

std::string text(const absl::Status& status) { return std::string(status.message()); }

// Readers never see half of it.
bool write_ready_file(const std::string& path, const std::string& address) {
  const std::string draft = path + ".new";
  {
    std::ofstream file(draft, std::ios::trunc);
    file << address << '\n';
    if (!file.flush()) return false;
  }
  return std::rename(draft.c_str(), path.c_str()) == 0;
}

// The loop of the one thread that owns link and state machine.
void serve(Coordinator& coordinator, DdsLink& link, RequestQueue& queue, const StopSignals& signals) {
  using Clock = std::chrono::steady_clock;
  using Shutdown = ClientCall<v1::ShutdownRequest, v1::ShutdownReply>;
  const Clock::time_point start = Clock::now();
  const auto now = [&] { return Nanoseconds(Clock::now() - start); };
  const auto send = [&] {
    for (const OutgoingMessage& outgoing : coordinator.take_messages()) {
      link.send(outgoing.to, outgoing.message.SerializeAsString());
    }
  };
  while (!coordinator.finished()) {
    if (signals.wanted()) coordinator.handle(Shutdown{{}, [](const absl::Status&, const auto&) {}}, now());
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
        spdlog::warn("a message of node {:x} cannot be read", delivery.from.value);
      }
    }
    for (const NodeId node : link.take_lost_peers()) {
      if (!coordinator.suspect(node, now())) link.forget(node);
    }
    coordinator.advance(now());
    send();
  }
  queue.close();
  for (ClientRequest& request : queue.take()) coordinator.handle(std::move(request), now());
}

int run(Arguments& arguments) {
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
  const std::string& address = (*edge)->address();
  if (absl::Status status = (*link)->announce_coordinator(address); !status.ok()) {
    spdlog::error("{}", text(status));
    return 1;
  }
  if (!arguments.ready_file.empty() && !write_ready_file(arguments.ready_file, address)) {
    spdlog::error("cannot write {}", arguments.ready_file);
    return 1;
  }
  std::printf("listening on %s\n", address.c_str());
  std::fflush(stdout);
  spdlog::info("cluster {}, domain {}, clients on {}", arguments.dds.cluster, arguments.dds.domain, address);

  arguments.coordinator.log = [](const std::string& line) { spdlog::info("{}", line); };
  Coordinator coordinator(arguments.coordinator);
  waker.attach(link->get());
  serve(coordinator, **link, queue, signals);
  waker.attach(nullptr);
  (*edge)->close();
  if (!arguments.ready_file.empty()) std::remove(arguments.ready_file.c_str());
  return 0;
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
  tessera::Arguments arguments;
  const pid_t parent = getppid();
  if (const std::optional<int> code = tessera::parse(argc, argv, arguments)) return *code;
  if (arguments.exit_with_parent) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) return 1;  // it ended before we asked
  }
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);  // its failures are ours to tell
  spdlog::set_level(spdlog::level::from_str(arguments.log_level));
  spdlog::set_pattern("%H:%M:%S.%e %^%l%$ coordinator: %v");
  return tessera::run(arguments);
}
