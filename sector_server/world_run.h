// One loaded world on one sector server: carries out grants tick by tick, round by round, as messages allow.
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "cluster.pb.h"
#include "lpss/partition/bodies.h"
#include "lpss/tick/tick_machine.h"
#include "sector_server/grant_queue.h"
#include "sector_server/memory_return.h"
#include "sector_server/peer_probes.h"
#include "sector_server/query_answers.h"
#include "sector_server/round_exchange.h"
#include "sector_server/tick_meter.h"
#include "sector_server/tick_reports.h"
#include "transport/link.h"

namespace tessera {

// The servers of a world from tick `since` on: others than before, or with other sectors.
struct NewServers {
  Tick since = 0;
  std::size_t servers = 0;
  // What clients ask for, where this server begins to take part.
  std::vector<v1::Subscription> subscriptions;
};

class WorldRun {
 public:
  using Nanoseconds = std::chrono::nanoseconds;
  using Clock = std::function<Nanoseconds()>;
  using Send = RoundExchange::Send;
  using Traffic = RoundExchange::Traffic;
  using MakeEngine = std::function<absl::StatusOr<std::unique_ptr<Engine>>(const EngineSettings&)>;

  // Fails, with the reason, for a world that this server cannot host. Takes the shapes out of the message.
  //
  // Of a guest (see v1::Guest) it has no machine: it hosts nothing, and waits for nobody.
  static absl::StatusOr<std::unique_ptr<WorldRun>> create(v1::LoadWorld& load, NodeId self, int threads,
                                                          const MakeEngine& make_engine, Send send);
  WorldRun(const WorldRun&) = delete;
  WorldRun& operator=(const WorldRun&) = delete;

  std::uint64_t world() const { return world_; }
  Tick tick() const { return tick_; }
  Partition& partition() { return *partition_; }
  TickMachine& machine() { return *machine_; }  // of one that takes part
  std::size_t body_count() const { return tessera::body_count(*partition_); }
  bool between_ticks() const { return !round_; }
  bool is_guest() const { return !machine_; }
  const std::vector<NodeId>& nodes() const { return exchange_.nodes(); }  // the servers, by rank
  // Once after each change of servers.
  std::optional<NewServers> take_new_servers() { return std::exchange(new_servers_, std::nullopt); }
  // Whether it no longer takes part: it has done all that the others need.
  bool has_left() const { return has_left_; }
  std::uint64_t map_epoch() const { return map_epoch_; }  // that is in effect

  // A guest is there, and may be among the servers soon; nothing happens if it is one of them.
  void welcome(NodeId guest) { exchange_.welcome(guest); }

  // Grants and rounds, in any order. Errors: one that cannot be of this world, or too many that wait for
  // their turn; it is ignored.
  absl::Status take(v1::Grant grant);
  absl::Status take(NodeId from, v1::Round round) { return exchange_.take(from, std::move(round), tick_); }

  // Whose messages the round that is under way waits for; none where there is no such round, or none are
  // missing.
  std::optional<PeerProbes::Wait> awaited() const;

  // Whether proceed() has work to do; it does one round. `clock` measures work.
  bool ready() const;
  absl::Status proceed(const Clock& clock);

  // True once after each completed tick.
  bool take_tick_done() { return std::exchange(tick_done_, false); }

  // The reports of the ticks since the last call.
  std::vector<v1::TickReport> take_reports() {
    reported_map_ = map_epoch_;
    return reports_.take();
  }
  bool report_due() const;
  // Work on the current tick that was done while messages of others were awaited.
  void add_own_time(Nanoseconds time) { meter_.add_own(time); }
  const v1::TickReport& last_report() const { return reports_.last(); }
  const Traffic& traffic() const { return exchange_.traffic(); }
  // In which this server waited for tiles of ground.
  std::uint64_t ticks_waited_for_ground() const { return meter_.ticks_waited_for_ground(); }
  std::uint64_t moved_bytes() const;

 private:
  WorldRun(const v1::LoadWorld& load, int threads, std::unique_ptr<Engine> engine,
           std::unique_ptr<Partition> partition, RoundExchange exchange, Send send);

  RoundExchange::Key current_round() const { return {tick_ + 1, moving_, round_->number}; }
  absl::Status next_piece(const Clock& clock);
  absl::Status begin_tick(const std::string* packed_commands, const Clock& clock);
  absl::Status change_map(const v1::SectorMap& message, const Clock& clock);
  void join();
  absl::Status add_what_is_new(v1::Grant& grant);
  absl::Status follow(const v1::Grant& grant);
  absl::Status advance(const Clock& clock);
  void go_on(std::optional<Round> round, Nanoseconds began, const Clock& clock);
  void end_move(Nanoseconds now);
  void end_tick(Nanoseconds now);

  const std::uint64_t world_;
  const int threads_;
  const std::unique_ptr<Engine> engine_;
  const std::unique_ptr<Partition> partition_;
  std::unique_ptr<TickMachine> machine_;  // null of a guest
  RoundExchange exchange_;
  GrantQueue grants_;
  QueryAnswers answers_;
  TickMeter meter_;
  TickReports reports_;
  MemoryReturn memory_;

  Tick tick_;                   // completed
  std::optional<Round> round_;  // in which the current tick waits, or the change of the map before it
  std::uint64_t moving_ = 0;    // the epoch of the map that is about to change; 0: none
  std::uint64_t map_epoch_;
  std::uint64_t reported_map_;  // of which it was the epoch
  std::optional<NewServers> new_servers_;
  bool has_left_ = false;
  bool tick_done_ = false;
};

}  // namespace tessera
