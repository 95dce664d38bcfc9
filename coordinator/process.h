// The process around a coordinator: what it listens to, and the loop of the thread that owns it.
#pragma once

#include <absl/status/statusor.h>

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "coordinator/client_edge.h"
#include "coordinator/coordinator.h"
#include "coordinator/options.h"
#include "coordinator/request_queue.h"
#include "daemon/monitor.h"
#include "daemon/stop_signals.h"
#include "keys/gate.h"
#include "transport/dds_link.h"
#include "transport/waker.h"

namespace tessera {

// The keys of the arguments, of which its bus makes use from then on. Errors as open_locks() and lock_bus().
absl::StatusOr<std::optional<ServerKeys>> lock_doors(CoordinatorArguments& arguments);

// Of this machine, since an arbitrary start.
Nanoseconds steady_time();

class CoordinatorProcess {
 public:
  explicit CoordinatorProcess(const CoordinatorArguments& arguments);

  // Listens to clients, who are answered once serve() or refuse_clients() is called; `beside` is served, too.
  // Errors as ClientEdge::open() and Monitor::open().
  absl::Status open(const std::optional<ServerKeys>& keys, grpc::Service* beside = nullptr);
  // Tells whoever started this process that clients may come.
  absl::Status say_ready();
  void close();

  const std::string& address() const { return edge_->address(); }

  // Runs `coordinator` over `link` until it has finished; false where `leads` says no before. The caller's
  // thread owns both meanwhile.
  bool serve(Coordinator& coordinator, DdsLink& link, const std::function<bool()>& leads);

  // Answers all requests that have come with `status`.
  void refuse_clients(const absl::Status& status);
  // Until something happens, for a moment at most.
  void wait();

  bool is_to_end() const { return signals_.wanted(); }
  // Ends the waiting of the thread that serves. For any thread.
  void wake();

 private:
  void take_requests(Coordinator& coordinator, Nanoseconds now);
  absl::Status open_monitor(const std::optional<ServerKeys>& keys);

  const CoordinatorArguments& arguments_;
  Waker waker_;
  std::mutex mutex_;
  std::condition_variable woken_;
  bool is_woken_ = false;
  const StopSignals signals_;
  RequestQueue queue_;
  std::unique_ptr<ClientEdge> edge_;
  const Coordinator* coordinator_ = nullptr;  // while it serves; of the thread that serves
  Pulse pulse_;
  std::unique_ptr<Monitor> monitor_;
};

}  // namespace tessera
