// A whole cluster in one thread, on a simulated network with a seed: the production state machines, nothing
// else.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "coordinator/coordinator.h"
#include "lpss/model/world_description.h"
#include "lpss/tick/messages.h"
#include "sector_server/sector_server.h"
#include "transport/sim_network.h"

namespace tessera {

class SimulatedCluster {
 public:
  // A coordinator and `servers` sector servers of the world's precision; the seed decides when each message
  // arrives. Nothing is loaded yet.
  SimulatedCluster(std::uint64_t seed, std::uint32_t servers, Precision precision,
                   const SimOptions& network = {});
  ~SimulatedCluster();

  // Asked before each event from now on: true ends the call that waits with CANCELLED.
  void end_when(std::function<bool()> is_ended) { is_ended_ = std::move(is_ended); }

  // The cluster runs until the answer is there. DEADLINE_EXCEEDED when nothing more can happen before that.
  absl::Status load(const WorldDescription& world);
  absl::StatusOr<v1::StepReply> step(std::uint64_t ticks);
  absl::StatusOr<v1::HashReply> hash();
  absl::StatusOr<v1::StatusReply> status();

  // Any other request.
  template <typename Request, typename Answer>
  absl::StatusOr<Answer> call(Request request);

  SimNetwork& network() { return network_; }
  NodeId server_node(std::uint32_t i) const { return servers_.at(i).node; }
  std::uint64_t events() const { return events_; }

 private:
  struct Server {
    NodeId node;
    std::unique_ptr<Link> link;
    std::unique_ptr<SectorServer> machine;
    std::uint64_t timer_ns = 0;  // set and not yet run out
  };

  Nanoseconds now() const { return Nanoseconds(static_cast<std::int64_t>(network_.now_ns())); }
  bool run_one_event();
  void run_coordinator();
  void run_server(Server& server);
  void keep_timer(NodeId node, std::uint64_t& timer_ns, std::optional<Nanoseconds> deadline);

  SimNetwork network_;
  Coordinator coordinator_;
  std::unique_ptr<Link> coordinator_link_;
  std::uint64_t coordinator_timer_ns_ = 0;
  std::vector<Server> servers_;
  std::uint64_t events_ = 0;
  std::function<bool()> is_ended_ = [] { return false; };
};

template <typename Request, typename Answer>
absl::StatusOr<Answer> SimulatedCluster::call(Request request) {
  constexpr std::uint64_t kEventsMax = 20'000'000;
  const auto result = std::make_shared<std::optional<absl::StatusOr<Answer>>>();  // may come after the call
  coordinator_.handle(ClientCall<Request, Answer>{std::move(request),
                                                  [result](absl::Status status, const Answer& answer) {
                                                    if (status.ok()) {
                                                      *result = answer;
                                                    } else {
                                                      *result = status;
                                                    }
                                                  }},
                      now());
  run_coordinator();
  const std::uint64_t last = events_ + kEventsMax;
  while (!*result && events_ < last) {
    if (is_ended_()) return absl::CancelledError("interrupted");
    if (!run_one_event()) break;
  }
  if (!*result) return absl::DeadlineExceededError("the simulated cluster came to a halt without an answer");
  return **std::move(result);
}

}  // namespace tessera
