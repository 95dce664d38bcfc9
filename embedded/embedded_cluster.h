// A whole cluster inside one process: a coordinator and sector servers as state machines, whose messages go
// from one to the other without a network. What clients ask of it has the answers, and the bits, of a cluster
// of daemons.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <concepts>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "coordinator/coordinator.h"
#include "daemon/log_line.h"
#include "lpss/model/precision.h"
#include "sector_server/sector_server.h"

namespace tessera {

struct EmbeddedClusterOptions {
  Precision precision = Precision::kFloat32;
  std::uint32_t servers = 1;  // that share each world: the bits are the same for any number
  int threads = 1;            // of each server
  LogSink log;                // events; may be empty
};

// Safe to use from any thread. Calls are answered on the caller's thread, one after the other. Time stands
// still between them, so that nothing is taken for lost while nobody asks; only a world that runs
// (ResumeRequest) has a thread of its own, which keeps its pace.
class EmbeddedCluster {
 public:
  explicit EmbeddedCluster(const EmbeddedClusterOptions& options);
  ~EmbeddedCluster();
  EmbeddedCluster(const EmbeddedCluster&) = delete;
  EmbeddedCluster& operator=(const EmbeddedCluster&) = delete;

  // Asked now and then while a call waits: whether it is to end.
  using IsInterrupted = std::function<bool()>;

  // The answer to a request. Errors are the coordinator's; DEADLINE_EXCEEDED if there is none within
  // `timeout`, and CANCELLED once `is_interrupted`: the request may take effect nevertheless.
  template <typename Request, typename Answer>
  absl::StatusOr<Answer> call(Request request, std::optional<Nanoseconds> timeout = {},
                              const IsInterrupted& is_interrupted = {});

  // From now on, clients of other processes may come to `listen` ("host:port"; port 0: any free one), as to a
  // gateway, without keys. The address; the same again once there is one. FAILED_PRECONDITION for one that is
  // not of loopback, which other hosts could reach; errors as ClientEdge::open().
  absl::StatusOr<std::string> serve(const std::string& listen);

 private:
  class Door;
  class Processes;

  using Clock = std::chrono::steady_clock;

  void post(ClientRequest request);
  // Until `is_answered`, on this thread or on that of the world that runs.
  absl::Status work_until(const std::function<bool()>& is_answered, std::optional<Nanoseconds> timeout,
                          const IsInterrupted& is_interrupted);
  // For whoever has `working_`: whether anything was done.
  bool take_turn();
  std::vector<ClientRequest> take_requests();
  // A world that runs, and clients of other processes, have a thread of their own.
  void keep_running();
  bool is_self_driven() const { return is_running_ || door_ != nullptr; }
  void run();
  void wake();

  std::mutex working_;  // held for a turn; guards the following
  std::unique_ptr<Processes> processes_;

  std::mutex mutex_;  // guards the following, and the answers
  std::unique_ptr<Door> door_;
  bool is_woken_ = false;
  std::condition_variable changed_;
  std::vector<ClientRequest> requests_;
  bool is_running_ = false;
  bool is_ending_ = false;
  std::thread runner_;
};

// Whether a world runs once such a request has been answered; nothing: as before.
template <typename Request>
std::optional<bool> runs_after() {
  if constexpr (std::same_as<Request, v1::ResumeRequest>) return true;
  constexpr bool kEnds = std::same_as<Request, v1::PauseRequest> || std::same_as<Request, v1::LoadRequest> ||
                         std::same_as<Request, RestoreChunks> || std::same_as<Request, v1::UnloadRequest>;
  return kEnds ? std::optional(false) : std::nullopt;
}

template <typename Request, typename Answer>
absl::StatusOr<Answer> EmbeddedCluster::call(Request request, std::optional<Nanoseconds> timeout,
                                             const IsInterrupted& is_interrupted) {
  const auto place = std::make_shared<std::optional<absl::StatusOr<Answer>>>();
  ClientCall<Request, Answer> call;
  call.request = std::move(request);
  call.reply = [this, place](const absl::Status& status, const Answer& answer) {
    const std::lock_guard lock(mutex_);
    if (!status.ok()) {
      *place = status;
    } else {
      *place = answer;
      if (const std::optional<bool> runs = runs_after<Request>()) is_running_ = *runs;
    }
    changed_.notify_all();
  };
  post(std::move(call));
  const absl::Status status = work_until([&] { return place->has_value(); }, timeout, is_interrupted);
  if (!status.ok()) return status;
  keep_running();
  return **std::move(place);
}

}  // namespace tessera
