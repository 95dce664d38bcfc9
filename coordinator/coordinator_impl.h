// The implementation of the coordinator, over several files: coordinator.cc (messages and servers),
// loading.cc (loading and unloading worlds), recovery.cc (what keeps a world alive when servers come and go),
// balancing.cc (what divides it anew while it runs), server_changes.cc (servers that join and leave then),
// stored_world.cc (what makes it outlive this process), client_requests.cc (all other requests of clients),
// status.cc (status replies).
#pragma once

#include <absl/container/flat_hash_set.h>
#include <absl/status/statusor.h>

#include <concepts>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/active_world.h"
#include "coordinator/balance.h"
#include "coordinator/coordinator.h"
#include "coordinator/membership.h"
#include "coordinator/placement.h"
#include "coordinator/recording.h"
#include "coordinator/sessions.h"

namespace tessera {

class Coordinator::Impl {
 public:
  explicit Impl(const CoordinatorOptions& options);
  absl::Status resume_stored();
  void retire();
  void abandon();

  void handle(ClientRequest request, Nanoseconds now);
  void receive(NodeId from, v1::ClusterMessage message, Nanoseconds now);
  bool suspect(NodeId node, Nanoseconds now);
  void advance(Nanoseconds now);
  std::optional<Nanoseconds> next_deadline() const;
  std::vector<OutgoingMessage> take_messages();
  void lost(NodeId node, const std::string& how, Nanoseconds now);
  std::map<NodeId, std::string> server_addresses() const;
  bool finished() const { return finished_ && held_back_.empty(); }
  const DurationHistogram* tick_durations() const {
    return world_ ? &world_->statistics.durations() : nullptr;
  }

 private:
  template <typename Request, typename Answer>
  using Call = ClientCall<Request, Answer>;

  // A load whose world is valid and whose servers have not all joined.
  struct WaitingLoad {
    std::function<void(const absl::Status&, const v1::LoadReply&)> reply;
    WorldToLoad world;
    Nanoseconds deadline{};
  };

  // A server that hosts nothing once the world has moved on, and who waits for that.
  struct Drain {
    NodeId node;
    std::function<void(const absl::Status&, const v1::DrainReply&)> reply;
  };

  // What is told only once the inputs up to `position` are stored.
  struct HeldBack {
    std::uint64_t position = 0;
    std::vector<OutgoingMessage> messages;
    std::vector<std::function<void(const absl::Status&)>> replies;
  };

  // coordinator.cc
  v1::ClusterMessage& send(NodeId to);
  void send_grant(v1::Grant grant);
  void flush(Nanoseconds now);
  void send_grants(Nanoseconds now);
  void log(std::string text, Severity severity = Severity::kInfo) const;
  void on_hello(NodeId from, const v1::Hello& hello, Nanoseconds now);
  void heard(Server& server, Nanoseconds now);
  void on_stranger(NodeId from);
  void on_loaded(NodeId from, const v1::Loaded& loaded, Nanoseconds now);
  void on_report(Server& server, const v1::Report& report, Nanoseconds now);
  void name_slow_server();
  void on_answer(NodeId from, v1::Answer answer);
  void shut_down(const std::string& reason);

  // loading.cc
  void on(Call<v1::LoadRequest, v1::LoadReply>& call, Nanoseconds now);
  void on(Call<RestoreChunks, v1::LoadReply>& call, Nanoseconds now);
  void on(Call<v1::UnloadRequest, v1::UnloadReply>& call, Nanoseconds now);
  absl::Status may_load(bool replace) const;
  void try_start();
  std::vector<NodeId> fit_nodes(Precision precision) const;
  std::vector<NodeId> chosen_nodes(Precision precision) const;
  std::vector<NodeId> ranked(std::vector<NodeId> nodes);
  double capacity_of(NodeId node);
  std::vector<Host> hosts(const std::vector<NodeId>& nodes);
  std::string described_servers(Precision precision) const;
  void start(WaitingLoad load, const std::vector<NodeId>& nodes);
  std::unique_ptr<ActiveWorld> make_world(std::shared_ptr<const WorldToLoad> from, std::uint64_t load,
                                          std::uint64_t number, const std::vector<NodeId>& nodes) const;
  void send_loads(Placement placement, Tick tick);
  void give_up_waiting(const absl::Status& status);
  void finish_load();
  void close_world(const absl::Status& status, const std::vector<NodeId>& staying);
  void fail_world(const std::string& failure, absl::StatusCode code, Nanoseconds now);
  std::string missing_servers(const WaitingLoad& load) const;

  // recovery.cc
  bool survives_losses() const { return options_.checkpoint_every > Nanoseconds::zero(); }
  void tend_checkpoints(Nanoseconds now);
  bool may_ask_for_checkpoint() const;
  void ask_for_checkpoint();
  bool may_recover();
  void gather(Nanoseconds now);
  void recover();
  void hand_over_streams(Placement& placement);
  void go_on_again();

  // server_changes.cc
  void tend_servers(Nanoseconds now);
  std::vector<NodeId> wanted_nodes() const;
  bool has_last_map();
  bool may_share_out() const;
  bool invite(NodeId node);
  void guest_is_loaded(const v1::Loaded& loaded);
  void dismiss_guest();
  void admit_guest();
  void empty(std::size_t rank);
  void part_with_leaver(Nanoseconds now);
  void change_servers(const v1::SectorMap& map);
  v1::Subscriptions all_subscriptions() const;
  void answer_drains();
  void on(Call<v1::DrainRequest, v1::DrainReply>& call, Nanoseconds now);

  // balancing.cc
  void tend_balance(Nanoseconds now);
  bool may_balance() const;
  void ask_for_load();
  v1::Query load_query(Queries::LoadReply reply);
  absl::StatusOr<std::vector<ServerLoad>> checked_loads(const std::vector<v1::ServerLoad>& messages);
  void set_map(const SectorMap& map, std::uint64_t moved_sectors, std::uint64_t moved_bodies);
  void on(Call<v1::BalanceRequest, v1::BalanceReply>& call, Nanoseconds now);

  // stored_world.cc
  bool stores() const { return options_.store != nullptr && !store_.given_up; }
  bool waits_for_store() const { return stores() && options_.wait_for_store && !store_.failure.empty(); }
  template <typename Request, typename Answer>
  void reply_once_stored(Call<Request, Answer>& call);
  template <typename Request, typename Answer>
  bool is_new(Call<Request, Answer>& call);
  template <typename Request>
  void store_command(const Request& request, Tick tick, std::uint64_t id, CallId call);
  bool is_pace_stored(const v1::StoredPace& next) const;
  void store_pace(Nanoseconds now);
  void store_inputs(Nanoseconds now);
  void write_inputs(Nanoseconds now);
  void pass_by_held();
  std::uint64_t rests_on() const;
  void release();
  void drop_unstored(const absl::Status& status);
  void give_up_world(const absl::Status& status);
  absl::Status room_for_command(const Sequencer& sequencer, std::size_t shape_bytes) const;
  absl::Status store_beginning(std::uint64_t load, const WorldToLoad& world);
  void take_down_catalogue();
  void store_checkpoint(const KeptChunks& changes, std::uint64_t position);
  absl::Status forget_stored();
  void store_failed(const absl::Status& status, Nanoseconds now);
  std::uint64_t stored_position() const { return options_.store->position() + unstored_.size(); }

  // client_requests.cc
  static WorldCatalogue with_held(const ActiveWorld& world, WorldCatalogue catalogue);
  absl::StatusOr<ActiveWorld*> live_world() const;
  void on(Call<v1::SpawnRequest, v1::SpawnReply>& call, Nanoseconds now);
  void on(Call<v1::AddJointRequest, v1::AddJointReply>& call, Nanoseconds now);
  template <typename Request>
  void on(Call<Request, v1::CommandReply>& call, Nanoseconds now);
  void on(Call<v1::PauseRequest, v1::PauseReply>& call, Nanoseconds now);
  void on(Call<v1::ResumeRequest, v1::ResumeReply>& call, Nanoseconds now);
  void on(Call<v1::StepRequest, v1::StepReply>& call, Nanoseconds now);
  void on(Call<v1::HashRequest, v1::HashReply>& call, Nanoseconds now);
  void on(Call<v1::SnapshotRequest, SnapshotChunks>& call, Nanoseconds now);
  void on(Call<v1::RaycastRequest, v1::RaycastReply>& call, Nanoseconds now);
  void on(Call<v1::NearRequest, v1::NearReply>& call, Nanoseconds now);
  void on(Call<v1::FindBodiesRequest, v1::FindBodiesReply>& call, Nanoseconds now);
  void on(Call<v1::ListJointsRequest, v1::ListJointsReply>& call, Nanoseconds now);
  void on(Call<v1::ListFramesRequest, v1::ListFramesReply>& call, Nanoseconds now);
  void on(Call<v1::ShutdownRequest, v1::ShutdownReply>& call, Nanoseconds now);

  // status.cc
  void on(Call<v1::StatusRequest, v1::StatusReply>& call, Nanoseconds now);
  v1::StatusReply status(Nanoseconds now) const;
  const char* state() const;
  void describe_world(v1::StatusReply& reply, Nanoseconds now) const;
  void describe_server(const Server& server, v1::ServerStatus& status) const;

  CoordinatorOptions options_;
  Membership members_;
  Sessions sessions_;
  absl::flat_hash_set<NodeId> strangers_;  // unknown servers that have been notified
  std::unique_ptr<ActiveWorld> world_;
  std::optional<WaitingLoad> waiting_load_;
  std::optional<v1::StatusReply> failed_;  // the last status of a world that failed
  std::uint64_t loads_ = 0;
  std::uint64_t worlds_ = 0;  // sent to servers: loads, and worlds that were set back
  std::vector<Drain> drains_;

  std::vector<v1::StoredInput> unstored_;
  std::vector<std::function<void(const absl::Status& stored)>> replies_;  // that rest on what is to be stored
  std::deque<HeldBack> held_back_;
  std::vector<OutgoingMessage> released_;
  std::optional<v1::StoredPace> stored_pace_;  // the last one, and the number of its input
  std::uint64_t pace_position_ = 0;
  Nanoseconds pace_time_{};       // when it was
  std::uint64_t pace_ahead_ = 0;  // ticks that it makes certain beyond those that were granted
  Tick safe_tick_ = 0;            // that a stored pace makes certain
  // The store, where it cannot be written.
  struct {
    std::string failure;  // empty while all is well
    Nanoseconds next_try{};
    bool given_up = false;      // too much came meanwhile
    std::string state_failure;  // why the last checkpoint is not there; empty if it is
  } store_;
  bool was_moving_ = false;
  bool finished_ = false;
  std::vector<OutgoingMessage> outbox_;
};

// Answers that are not given before what they rest on is on disk.
template <typename Answer>
concept RestsOnStore = CommandAnswer<Answer> || std::same_as<Answer, v1::PauseReply> ||
    std::same_as<Answer, v1::ResumeReply> || std::same_as<Answer, v1::StepReply>;

template <typename Request, typename Answer>
void Coordinator::Impl::reply_once_stored(Call<Request, Answer>& call) {
  if constexpr (RestsOnStore<Answer>) {
    if (!stores()) return;
    call.reply = [this, reply = std::move(call.reply)](const absl::Status& status, const Answer& answer) {
      if (!status.ok()) return reply(status, answer);  // errors rest on nothing
      replies_.push_back([reply, status, answer](const absl::Status& stored) {
        reply(stored.ok() ? status : stored, stored.ok() ? answer : Answer());
      });
    };
  }
}

// Of commands: the answers to other calls stay true if these are made again.
template <typename Request, typename Answer>
bool Coordinator::Impl::is_new(Call<Request, Answer>& call) {
  if constexpr (CommandAnswer<Answer>) {
    return sessions_.admit(call);
  } else {
    return true;
  }
}

template <typename Request>
void Coordinator::Impl::store_command(const Request& request, Tick tick, std::uint64_t id, CallId call) {
  if (!stores()) return;
  v1::StoredInput& input = unstored_.emplace_back();
  input.set_session(call.session);
  input.set_call(call.number);
  v1::RecordedCommand& command = *input.mutable_command();
  command.set_tick(tick);
  command.set_id(id);
  put(request, command);
}

}  // namespace tessera
