// A world on its servers: what they report, what they are granted, and how it goes on when one is lost.
#pragma once

#include <absl/status/status.h>

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "coordinator/active_world.h"
#include "coordinator/balancing.h"
#include "coordinator/checkpoint_rounds.h"
#include "coordinator/context.h"
#include "coordinator/link_watch.h"
#include "coordinator/server_changes.h"
#include "coordinator/torn_joints.h"

namespace tessera {

// The state of a world is a function of a checkpoint and of the commands since, so nothing that clients were
// told becomes untrue where the world goes back to one on other servers.
//
// Functions that return a status: with an error, the world cannot go on, for that reason, and is to be
// closed.
class HostedWorld {
 public:
  // A world that none of these servers has yet. `context` must outlive it.
  HostedWorld(const CoordinatorContext& context, std::shared_ptr<const WorldToLoad> from, std::uint64_t load,
              std::uint64_t number, std::vector<NodeId> nodes);

  ActiveWorld& world() { return world_; }
  const ActiveWorld& world() const { return world_; }
  Balancing& balancing() { return balancing_; }
  bool loading() const { return world_.loading(); }
  bool recovering() const { return world_.recovering(); }
  Tick completed() const { return world_.sequencer.completed(); }

  // Sends the servers what they host of it.
  void load(Placement placement, ActiveWorld::Load call);
  // Whether they all have it, and the call waits for end_load(), which answers it: the world begins.
  bool is_everywhere() const { return loading() && world_.servers.hosts(); }
  void end_load();

  // Messages of servers. None but on_answer() comes from a server that is not a member.
  absl::Status on_loaded(Server& server, const v1::Loaded& loaded);
  absl::Status on_report(Server& server, const v1::Report& report);
  void on_answer(NodeId from, v1::Answer answer);

  // A server has joined the cluster, which has heard of worlds up to that number.
  absl::Status on_joined(NodeId node, std::uint64_t newest_world, Nanoseconds now);
  // One that was a member is lost; `how` says why.
  // Where its commands are found to end servers, fatal_tick() tells, and the world is not set back.
  absl::Status on_lost(NodeId node, const std::string& how, bool process_has_ended);
  std::optional<Tick> fatal_tick() const;
  absl::Status advance(Nanoseconds now);  // deadlines

  // Servers that are cut off from others: all of them are to be given up.
  std::vector<LinkWatch::Dropped> take_cut_off(Nanoseconds now);
  // Whether a server may be about to be: another one of the world misses it, or it another one.
  bool is_doubtful(NodeId node) const { return links_.is_doubtful(node); }

  // Does all that is due, and sends the grants.
  void go_on(Nanoseconds now);
  std::optional<Nanoseconds> next_deadline() const;

  // All calls that wait get `status`.
  void abandon(const absl::Status& status);

  // Likewise, of a world whose servers get another one, and that may come back: it then goes on from the
  // earliest checkpoint, on the servers that are there.
  void suspend(const absl::Status& status);
  absl::Status come_back();
  // The streams of clients at the servers of `other` go on at those of this one.
  void take_streams(HostedWorld& other);

  void describe(v1::StatusReply& reply, Nanoseconds now) const;

 private:
  void send_loads(Placement placement, Tick tick);
  void send_grant(v1::Grant grant);
  void watch_links(const Server& server, const v1::Report& report);
  void name_slow_server();
  bool may_set_back();
  absl::Status set_back();
  std::vector<NodeId> next_servers() const;

  const CoordinatorContext& context_;
  ActiveWorld world_;
  std::optional<CheckpointRounds> checkpoints_;  // none: it ends with any of its servers
  Balancing balancing_;
  LinkWatch links_;
  ServerChanges changes_;
  TornJoints torn_;
  std::optional<Nanoseconds> gathers_until_;  // for servers, while it has none
  std::uint64_t recoveries_ = 0;
  std::deque<v1::CutOff> cut_off_;  // the last ones
  std::uint64_t cut_off_servers_ = 0;
  Tick last_loss_ = 0;  // completed when a server was lost
  std::uint32_t losses_in_place_ = 0;
  FatalTick fatal_;
  std::optional<NodeId> told_slow_;  // the server that was named as slow
  bool moved_ = false;               // at the last go_on()
};

}  // namespace tessera
