// One loaded world on one sector server: carries out grants tick by tick, round by round, as messages allow.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/container/flat_hash_map.h>
#include <absl/status/statusor.h>

#include <array>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "cluster.pb.h"
#include "lpss/partition/bodies.h"
#include "lpss/tick/tick_machine.h"
#include "sector_server/changed_chunks.h"
#include "transport/link.h"

namespace tessera {

// The servers of a world from tick `since` on.
struct NewServers {
  Tick since = 0;
  std::size_t servers = 0;
  // What clients ask for, where this server begins to take part.
  std::vector<v1::Subscription> subscriptions;
};

class WorldRun {
 public:
  using Nanoseconds = std::chrono::nanoseconds;
  using Send = std::function<void(NodeId, const v1::ClusterMessage&)>;
  using MakeEngine = std::function<absl::StatusOr<std::unique_ptr<Engine>>(const EngineSettings&)>;

  // Fails, with the reason, for a world that this server cannot host.
  //
  // Of a guest (see v1::Guest) it has no machine: it hosts nothing, and waits for nobody.
  static absl::StatusOr<std::unique_ptr<WorldRun>> create(const v1::LoadWorld& load, NodeId self, int threads,
                                                          const MakeEngine& make_engine, Send send);

  std::uint64_t world() const { return world_; }
  Tick tick() const { return tick_; }
  Partition& partition() { return *partition_; }
  TickMachine& machine() { return *machine_; }  // of one that takes part
  std::size_t body_count() const { return tessera::body_count(*partition_); }
  bool between_ticks() const { return !round_; }
  bool is_guest() const { return !machine_; }
  const std::vector<NodeId>& nodes() const { return nodes_; }  // the servers, by rank
  // Once after each change of servers.
  std::optional<NewServers> take_new_servers() { return std::exchange(new_servers_, std::nullopt); }
  // Whether it no longer takes part: it has done all that the others need.
  bool has_left() const { return has_left_; }
  std::uint64_t map_epoch() const { return map_epoch_; }  // that is in effect

  // A guest is there, and may be among the servers soon.
  void welcome(NodeId guest);

  // Grants and rounds, in any order. Errors: one that cannot be of this world, or too many that wait for
  // their turn; it is ignored.
  absl::Status take(v1::Grant grant);
  absl::Status take(NodeId from, v1::Round round);

  // Whether proceed() has work to do; it does one round. `clock` measures work.
  bool ready() const;
  absl::Status proceed(const std::function<Nanoseconds()>& clock);

  // True once after each completed tick.
  bool take_tick_done() { return std::exchange(tick_done_, false); }

  // The reports of the ticks since the last call.
  std::vector<v1::TickReport> take_reports() {
    reported_map_ = map_epoch_;
    return std::exchange(reports_, {});
  }
  bool report_due() const;
  // Work on the current tick that was done while messages of others were awaited.
  void add_own_time(Nanoseconds time) { own_time_ += time; }
  const v1::TickReport& last_report() const { return last_report_; }
  // Between this server and others, by the kind of round.
  struct Traffic {
    TrafficByRound sent{};
    TrafficByRound received{};

    RoundTraffic all_sent() const;
  };
  const Traffic& traffic() const { return traffic_; }
  // In which this server waited for tiles of ground.
  std::uint64_t ticks_waited_for_ground() const { return ticks_waited_for_ground_; }
  std::uint64_t moved_bytes() const;

 private:
  // The messages of one round, by the node that sent them.
  using Inbox = absl::flat_hash_map<std::uint64_t, std::string>;
  // Tick, epoch of the map where sectors change servers before it (else 0), number of the round.
  using RoundKey = std::tuple<Tick, std::uint64_t, std::uint32_t>;

  WorldRun() = default;

  RoundKey current_round() const;
  bool has_all() const;
  void send(const Round& round);
  absl::Status next_grant_or_tick(const std::function<Nanoseconds()>& clock);
  absl::Status begin_tick(const std::function<Nanoseconds()>& clock);
  absl::Status change_map(const v1::SectorMap& message, const std::function<Nanoseconds()>& clock);
  void join(Rank self);
  void end_move(Nanoseconds now);
  absl::Status follow(const v1::Grant& grant);
  absl::Status advance(const std::function<Nanoseconds()>& clock);
  void go_on(std::optional<Round> round, Nanoseconds began, const std::function<Nanoseconds()>& clock);
  void end_tick(Nanoseconds now);
  void give_back_memory();
  void answer(const v1::Query& query);
  void answer_with_snapshot(const v1::Query& query);
  std::vector<v1::SnapshotChunk> snapshot_chunks() const;
  absl::Status fill(const v1::LoadWorld& load);
  absl::Status restore(const v1::Restored& restored);
  void write_load(double ahead, v1::ServerLoad& answer);
  std::vector<NearBody> nearby(const v1::NearQuery& query);
  absl::Status add_shapes(const google::protobuf::RepeatedPtrField<v1::NumberedShape>& shapes);

  std::uint64_t world_ = 0;
  NodeId node_;  // this server's
  std::vector<NodeId> nodes_;
  std::vector<NodeId> guests_;  // that were welcome last
  Rank self_ = 0;
  int threads_ = 1;
  Send send_;
  std::unique_ptr<Engine> engine_;
  std::unique_ptr<Partition> partition_;
  std::unique_ptr<TickMachine> machine_;  // null of a guest
  bool hash_ticks_ = false;
  ChangedChunks changed_chunks_;
  std::size_t packed_before_ = 0;      // sectors, at the end of the last tick
  std::size_t packed_given_back_ = 0;  // when freed memory was given back

  absl::btree_map<std::uint64_t, v1::Grant> grants_;  // by serial, from the next one on
  std::uint64_t next_serial_ = 1;
  std::optional<v1::Grant> grant_;  // being carried out
  bool changes_map_ = false;
  std::uint64_t ticks_left_ = 0;
  int next_query_ = 0;

  std::optional<Round> round_;  // in which the current tick waits, or the change of the map before it
  std::uint64_t moving_ = 0;    // the epoch of the map that is about to change; 0: none
  Tick tick_ = 0;               // completed
  absl::btree_map<RoundKey, Inbox> inboxes_;
  std::uint64_t map_epoch_ = 0;
  std::uint64_t reported_map_ = 0;  // of which it was the epoch
  std::optional<NewServers> new_servers_;
  bool has_left_ = false;

  Nanoseconds tick_began_{};
  Nanoseconds own_time_{};   // of the current tick, without waiting
  Nanoseconds move_time_{};  // that the change of the map before the next tick took
  Nanoseconds move_own_time_{};
  double usual_own_us_ = 0;   // of the last ticks, mean
  double usual_wait_us_ = 0;  // likewise
  Tick ticks_here_ = 0;
  std::uint64_t ground_waits_ = 0;  // of the process, as the tick began
  std::uint64_t ticks_waited_for_ground_ = 0;
  bool tick_done_ = false;
  std::vector<v1::TickReport> reports_;
  v1::TickReport last_report_;
  Traffic traffic_;
};

}  // namespace tessera
