// A whole cluster in one thread on a simulated network with a seed, made of the production state machines.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/coordinator.h"
#include "lpss/model/world_description.h"
#include "lpss/tick/messages.h"
#include "sector_server/sector_server.h"
#include "simulator/fault_schedule.h"
#include "simulator/memory_store.h"
#include "transport/sim_network.h"

namespace tessera {

struct SimulatedClusterOptions {
  SimOptions network{.lease_ns = 1'000'000'000};
  InputSink inputs;  // as CoordinatorOptions::inputs
  Nanoseconds checkpoint_every = std::chrono::milliseconds(100);
};

class SimulatedCluster {
 public:
  // An answer that a client waits for.
  template <typename Answer>
  using Pending = std::shared_ptr<const std::optional<absl::StatusOr<Answer>>>;

  // A coordinator and `servers` sector servers of the world's precision; the seed decides when each message
  // arrives. Nothing is loaded yet.
  SimulatedCluster(std::uint64_t seed, std::uint32_t servers, Precision precision,
                   const SimulatedClusterOptions& options = {});
  ~SimulatedCluster();

  // Called before each event from now on: true ends the waiting call with CANCELLED.
  void end_when(std::function<bool()> is_ended) { is_ended_ = std::move(is_ended); }

  // The cluster runs until the answer arrives. DEADLINE_EXCEEDED if no events are left before that.
  absl::Status load(const WorldDescription& world);
  absl::Status restore(const SnapshotChunks& snapshot);  // in the place of a world that is loaded
  absl::StatusOr<v1::StepReply> step(std::uint64_t ticks);
  absl::StatusOr<v1::HashReply> hash();
  absl::StatusOr<v1::StatusReply> status();

  // Any other request.
  template <typename Request, typename Answer>
  absl::StatusOr<Answer> call(Request request) {
    return wait<Answer>(post<Request, Answer>(std::move(request)));
  }

  // The same in two parts, with other calls allowed in between. Errors of wait() as above.
  template <typename Request, typename Answer>
  Pending<Answer> post(Request request);
  template <typename Answer>
  absl::StatusOr<Answer> wait(const Pending<Answer>& pending);

  // Runs at most `count` events.
  void run_events(std::uint64_t count);

  // All commands that were stored since the load, in their order.
  const std::vector<v1::RecordedCommand>& stored_commands() const { return disk_.commands; }
  // Whether there is a coordinator at present; without one, calls fail with UNAVAILABLE, as do those that one
  // leaves without an answer.
  bool has_coordinator() const { return coordinator_ != nullptr; }

  // Schedules these faults, relative to now.
  void meet(const FaultSchedule& faults);
  // Runs until the last of them is over.
  void outlast_faults();

  std::vector<NodeId> servers() const;
  // Why a server ended by itself; nullopt while it runs, or if it crashed.
  std::optional<absl::Status> end_of(NodeId server) const;
  SimNetwork& network() { return network_; }
  std::uint64_t events() const { return events_; }

 private:
  struct Server {
    NodeId node;
    std::unique_ptr<Link> link;
    std::unique_ptr<SectorServer> machine;
    std::uint64_t timer_ns = 0;  // set and not yet expired
  };

  Nanoseconds now() const { return Nanoseconds(static_cast<std::int64_t>(network_.now_ns())); }
  bool run_one_event();
  void run_faults();
  void run_coordinator();
  void start_server();
  void start_coordinator();
  void crash_coordinator();
  void run_server(Server& server);
  void keep_timer(NodeId node, std::uint64_t& timer_ns, std::optional<Nanoseconds> deadline);

  const Precision precision_;
  SimNetwork network_;
  const CoordinatorOptions coordinator_options_;
  MemoryDisk disk_;
  std::unique_ptr<MemoryStore> store_;
  std::unique_ptr<Coordinator> coordinator_;  // null between two of them
  std::unique_ptr<Link> coordinator_link_;
  std::vector<std::function<void()>> unanswered_;  // what to do if the coordinator is lost
  std::uint64_t coordinator_timer_ns_ = 0;
  std::vector<Server> servers_;
  std::multimap<std::uint64_t, std::function<void()>> faults_;  // pending begins and ends, by time
  std::uint64_t events_ = 0;
  std::function<bool()> is_ended_ = [] { return false; };
};

template <typename Request, typename Answer>
SimulatedCluster::Pending<Answer> SimulatedCluster::post(Request request) {
  const auto result = std::make_shared<std::optional<absl::StatusOr<Answer>>>();
  const auto lose = [result] {
    if (!*result) *result = absl::UnavailableError("the coordinator was lost");
  };
  if (!coordinator_) {
    lose();
    return result;
  }
  unanswered_.push_back(lose);
  coordinator_->handle(
      ClientCall<Request, Answer>{std::move(request),
                                  [result](const absl::Status& status, const Answer& answer) {
                                    if (status.ok()) {
                                      *result = answer;
                                    } else {
                                      *result = status;
                                    }
                                  }},
      now());
  run_coordinator();
  return result;
}

template <typename Answer>
absl::StatusOr<Answer> SimulatedCluster::wait(const Pending<Answer>& pending) {
  constexpr std::uint64_t kEventsMax = 20'000'000;
  const std::uint64_t last = events_ + kEventsMax;
  while (!*pending && events_ < last) {
    if (is_ended_()) return absl::CancelledError("interrupted");
    if (!run_one_event()) break;
  }
  if (!*pending) return absl::DeadlineExceededError("the simulated cluster has no events left and no answer");
  return **pending;
}

}  // namespace tessera
