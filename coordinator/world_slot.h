// The place for the one world of a cluster.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "coordinator/context.h"
#include "coordinator/hosted_world.h"
#include "coordinator/sessions.h"
#include "coordinator/world_to_load.h"
#include "tessera.pb.h"

namespace tessera {

// It is empty, has a world, or what is left of one that failed; and in any case a load may wait for servers.
class WorldSlot {
 public:
  explicit WorldSlot(const CoordinatorContext& context) : context_(context) {}

  // Null where there is none.
  HostedWorld* hosted() { return hosted_.get(); }
  const HostedWorld* hosted() const { return hosted_.get(); }
  // The world that is loaded; otherwise what clients are told.
  absl::StatusOr<HostedWorld*> live();

  void load(ClientCall<v1::LoadRequest, v1::LoadReply>& call, Nanoseconds now);
  void load(ClientCall<RestoreChunks, v1::LoadReply>& call, Nanoseconds now);
  void unload(ClientCall<v1::UnloadRequest, v1::UnloadReply>& call);

  // Goes on with the world that is stored, if there is one, as soon as servers have joined; their sessions
  // remember what was answered. Errors of reading it; then nothing has changed.
  absl::Status resume_stored(Sessions& sessions);

  void on_loaded(Server& server, const v1::Loaded& loaded, Nanoseconds now);
  // A server of the cluster is lost; `how` says why.
  void on_lost(NodeId node, const std::string& how, bool process_has_ended, Sessions& sessions,
               Nanoseconds now);

  // Starts the load that waits, if the servers that it needs have joined.
  void try_start(Nanoseconds now);
  // Closes the world where `status` says that it cannot go on.
  void check(const absl::Status& status, Nanoseconds now);
  void advance(Nanoseconds now);  // deadlines
  std::optional<Nanoseconds> next_deadline() const;

  // All calls that wait get `status`. The world ends, and its servers are told; or it is left to others.
  void close(const absl::Status& status);
  void abandon(const absl::Status& status);

  v1::StatusReply status(Nanoseconds now) const;

 private:
  // A load whose world is valid and whose servers have not all joined.
  struct WaitingLoad {
    ActiveWorld::Load reply;
    std::shared_ptr<const WorldToLoad> world;
    Nanoseconds deadline{};
    int tries = 0;  // that have failed
  };

  absl::Status may_load(bool replace) const;
  absl::StatusOr<std::unique_ptr<HostedWorld>> stored_world(StoredWorld stored, Sessions& sessions);
  absl::Status leave_out(Tick tick, Sessions& sessions, Nanoseconds now);
  void wait_to_load(WorldToLoad world, ActiveWorld::Load reply, Nanoseconds now);
  void start(WaitingLoad load, const std::vector<NodeId>& nodes, Nanoseconds now);
  void end_load(Nanoseconds now);
  WaitingLoad drop_load(const absl::Status& status);
  void try_again(const absl::Status& status, Nanoseconds now);
  void bring_back(Nanoseconds now);
  void end_waiting(const absl::Status& status);
  void end_hosted(const absl::Status& status);
  void unload_except(const HostedWorld& hosted, const std::vector<NodeId>& staying) const;
  std::string missing_servers(const WaitingLoad& load) const;
  const char* state() const;
  void describe(const Server& server, v1::ServerStatus& status) const;

  const CoordinatorContext& context_;
  std::unique_ptr<HostedWorld> hosted_;
  std::unique_ptr<HostedWorld> replaced_;  // what the world being loaded replaces, until that has begun
  std::optional<WaitingLoad> waiting_;
  std::optional<WaitingLoad> started_;     // the load of the world that is being loaded
  std::optional<v1::StatusReply> failed_;  // the last status of a world that failed
  std::deque<v1::LeftOut> left_out_;
  std::uint64_t loads_ = 0;
};

}  // namespace tessera
