// A whole cluster in one thread on a simulated network and disk with a seed, made of the production state
// machines and the production store.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <concepts>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/coordinator.h"
#include "lpss/model/world_description.h"
#include "lpss/tick/messages.h"
#include "sector_server/sector_server.h"
#include "simulator/dice.h"
#include "simulator/fault_schedule.h"
#include "simulator/node_clock.h"
#include "simulator/simulated_disk.h"
#include "simulator/watched_store.h"
#include "transport/sim_network.h"

namespace tessera {

struct SimulatedClusterOptions {
  SimOptions network{.lease_ns = 1'000'000'000, .duplicates_one_in = 100};
  InputSink inputs;  // as CoordinatorOptions::inputs
  Nanoseconds checkpoint_every = std::chrono::milliseconds(100);
  std::function<void(const std::string& line)> log;  // of all processes, with times; may be empty
  // As of CoordinatorOptions.
  Nanoseconds balance_every{0};
  Nanoseconds balance_ahead{0};
  BalancePolicy balance_policy = BalancePolicy::kCurve;
  // The world is on all servers that there are, however many; else on as many as at first.
  bool takes_all_servers = false;
  // A server is busy for as long as this thread's processor is with what the server does, as if each had a
  // processor of its own: then times are measured, and differ from run to run. Else nothing takes time.
  bool takes_time = false;
  std::uint32_t all_linked_max = kAllLinkedMax;  // as of SectorServerOptions
  std::size_t shape_bytes_max = kShapeBytesMax;  // as of CoordinatorOptions
  // The processor time of each tick is measured.
  bool measures_work = false;
  std::function<void(NodeId, const v1::Report&)> reports;  // hears what servers report; may be empty
};

// The most processor time that a process took at a stretch: a server for its part of a tick, with what
// clients asked of it then, or the coordinator for what had come.
struct MeasuredWork {
  Nanoseconds longest{0};
  NodeId node{};
  Tick tick = 0;
};

// How often each kind of fault hit something.
using FaultCounts = std::array<std::uint64_t, kFaultKinds>;

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
  absl::Status load(const WorldDescription& world, bool replace = false);
  // In the place of a world that is loaded.
  absl::Status restore(const SnapshotChunks& snapshot, bool replay = false);
  absl::Status step(std::uint64_t ticks);
  struct HashAt {
    Tick tick = 0;
    std::string hash;
    std::string programs;  // their hash; empty: there are none
  };
  absl::StatusOr<HashAt> hash();
  absl::StatusOr<v1::StatusReply> status();

  // Any other request.
  template <typename Request, typename Answer>
  absl::StatusOr<Answer> call(Request request) {
    return wait<Answer>(post<Request, Answer>(std::move(request)));
  }

  // The same in two parts, with other calls allowed in between. Errors of wait() as above.
  template <typename Request, typename Answer>
  Pending<Answer> post(Request request, RequestId id = {});
  template <typename Answer>
  absl::StatusOr<Answer> wait(const Pending<Answer>& pending);

  // Among what the processes log.
  void log_of_clients(const std::string& text) const;

  // Runs at most `count` events.
  void run_events(std::uint64_t count);

  // ABORTED once something is not as it must be, such as a store that has lost what it had.
  const absl::Status& failure() const { return failure_; }

  // All lists of commands that are stored since the load, in their order.
  std::vector<v1::StoredInput> stored_commands() const { return history_.commands(); }
  // Those that clients were told of, and when they were told that these take effect.
  struct Told {
    RequestId id;
    Tick tick = 0;
    v1::Request request;
  };
  const std::vector<Told>& told_commands() const { return told_; }
  // Whether there is a coordinator at present; without one, calls fail with UNAVAILABLE, as do those that one
  // leaves without an answer.
  bool has_coordinator() const { return coordinator_ != nullptr; }

  // Schedules these faults, relative to now.
  void meet(const FaultSchedule& faults);
  // Runs until the last of them is over.
  void outlast_faults();
  const FaultCounts& faults() const { return fault_counts_; }
  const DiskFaultCounts& disk_faults() const { return disk_.faults(); }

  std::vector<NodeId> servers() const;
  // Why a server ended by itself; nullopt while it runs, or if it crashed.
  std::optional<absl::Status> end_of(NodeId server) const;
  SimNetwork& network() { return network_; }
  const SimNetwork& network() const { return network_; }
  std::uint64_t events() const { return events_; }
  const MeasuredWork& server_work() const { return server_work_; }
  const MeasuredWork& coordinator_work() const { return coordinator_work_; }

 private:
  struct Server {
    NodeId node;
    NodeClock clock;
    std::unique_ptr<Link> link;
    std::unique_ptr<SectorServer> machine;     // null once it has crashed
    std::optional<absl::Status> end;           // by itself
    std::uint64_t timer_ns = 0;                // set and not yet expired
    std::uint64_t work_ns = 0;                 // for each message
    Nanoseconds work_of_tick{0};               // so far, of the one after `machine->tick()`
    std::vector<SectorServer::Outgoing> done;  // to be sent when it has taken its time
  };

  // A coordinator that is to end in the middle of an operation on its disk.
  struct Dying {
    std::uint64_t number = 0;
    bool loses_power = false;
    std::uint64_t absent_ns = 0;
  };

  Nanoseconds now() const { return coordinator_clock_.at(network_.now_ns()); }
  absl::Status no_answer() const;
  bool run_one_event();
  void run_faults();
  void plan(std::uint64_t time_ns, std::function<void()> what);
  void run_coordinator();
  void start_server();
  void start_coordinator();
  void crash_coordinator(bool loses_power);
  void crash_coordinator_for(bool loses_power, std::uint64_t absent_ns);
  bool end_server(NodeId node);
  bool crash_server(NodeId node, std::uint64_t absent_ns);
  void begin_crash_in_recovery();
  void run_server(Server& server);
  void send_done(Server& server);
  void do_work(Server& server);
  void measure(NodeId node, Tick tick, Nanoseconds work);
  std::uint64_t worked_ns() const;
  void keep_timer(NodeId node, const NodeClock& clock, std::uint64_t& timer_ns,
                  std::optional<Nanoseconds> deadline);
  void log(NodeId node, const LogLine& line) const;
  LogSink sink_of(NodeId node) const;

  // faults.cc
  bool begin(const Fault& fault, std::uint64_t end_ns);
  bool begin_between(const Fault& fault, std::uint64_t end_ns);
  bool cut_for_good(LastingCut which, std::uint64_t pick);
  bool begin_disk_fault(FaultKind kind, std::uint64_t end_ns);
  bool begin_coordinator_crash(const Fault& fault, std::uint64_t absent_ns);
  bool jump(const Fault& fault);
  void drain(NodeId node);
  std::vector<NodeId> living_servers() const;
  std::vector<NodeId> living() const;
  Server* find(NodeId node);

  const Precision precision_;
  Dice dice_;
  SimNetwork network_;
  const SimulatedClusterOptions options_;
  const CoordinatorOptions coordinator_options_;
  SimulatedDisk disk_;
  StoreHistory history_;
  NodeClock coordinator_clock_;
  std::int64_t calendar_ms_;  // of the coordinator's host, when the network began
  std::unique_ptr<WatchedStore> store_;
  std::unique_ptr<Coordinator> coordinator_;  // null between two of them
  std::unique_ptr<Link> coordinator_link_;
  std::vector<std::function<void()>> requests_;    // that it has yet to take
  std::vector<std::function<void()>> unanswered_;  // what to do if the coordinator is lost
  std::vector<Told> told_;
  std::uint64_t coordinator_timer_ns_ = 0;
  std::vector<Server> servers_;
  std::optional<std::chrono::nanoseconds>
      work_began_;  // of the server that does something, if that takes time
  std::multimap<std::uint64_t, std::function<void()>> faults_;  // pending begins and ends, by time
  std::vector<Fault> armed_;                                    // crashes that wait for a recovery
  std::optional<Dying> dying_;
  std::uint64_t last_dying_ = 0;
  std::set<NodeId> without_coordinator_;  // servers whose link to it is cut for good
  int full_disks_ = 0;                    // at present, as below
  int failing_disks_ = 0;
  FaultCounts fault_counts_{};
  MeasuredWork server_work_;
  MeasuredWork coordinator_work_;
  absl::Status failure_;
  std::uint64_t events_ = 0;
  std::function<bool()> is_ended_ = [] { return false; };
};

template <typename Request, typename Answer>
SimulatedCluster::Pending<Answer> SimulatedCluster::post(Request request, RequestId id) {
  const auto result = std::make_shared<std::optional<absl::StatusOr<Answer>>>();
  const auto lose = [result] {
    if (!*result) *result = absl::UnavailableError("the coordinator was lost");
  };
  if (!coordinator_) {
    lose();
    return result;
  }
  unanswered_.push_back(lose);
  const auto call = std::make_shared<ClientCall<Request, Answer>>();
  call->request = std::move(request);
  call->id = id;
  call->reply = [result](const absl::Status& status, const Answer& answer) {
    if (*result) return;  // whom the client did not wait for
    if (status.ok()) {
      *result = answer;
    } else {
      *result = status;
    }
  };
  if constexpr (std::same_as<Request, v1::Request>) {
    call->reply = [this, id, request = call->request, reply = std::move(call->reply)](
                      const absl::Status& status, const v1::Reply& answer) {
      if (status.ok() && !request.commands().empty()) told_.push_back({id, answer.applied().tick(), request});
      reply(status, answer);
    };
  }
  requests_.push_back([this, call] { coordinator_->handle(std::move(*call), now()); });
  network_.set_timer(kCoordinatorNode, network_.now_ns());
  return result;
}

template <typename Answer>
absl::StatusOr<Answer> SimulatedCluster::wait(const Pending<Answer>& pending) {
  constexpr std::uint64_t kEventsMax = 2'000'000;
  const std::uint64_t last = events_ + kEventsMax;
  while (!*pending && events_ < last) {
    if (is_ended_()) return absl::CancelledError("interrupted");
    if (!failure_.ok()) return failure_;
    if (!run_one_event()) break;
  }
  if (!*pending) return no_answer();
  return **pending;
}

}  // namespace tessera
