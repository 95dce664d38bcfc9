// Calls of clients about a world that is loaded.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>

#include "coordinator/active_world.h"
#include "coordinator/asked_queries.h"
#include "coordinator/command_list.h"
#include "coordinator/context.h"
#include "coordinator/coordinator.h"

namespace tessera {

// Each function answers one call, at once or when its world has come to it: what waits is answered before the
// world ends.
class WorldCalls {
 public:
  template <typename Request, typename Answer>
  using Call = ClientCall<Request, Answer>;

  WorldCalls(const CoordinatorContext& context, ActiveWorld& world, Nanoseconds now)
      : context_(context), world_(world), now_(now) {}

  // Its commands are checked, carried out on the registry, sequenced and added to the journal; but not where
  // they were `carried_out` before, of a request that is made again. Returns what they did, or nothing after
  // an error.
  std::optional<v1::Applied> on(Call<v1::Request, v1::Reply>& call, std::optional<v1::Applied> carried_out);

  void on(Call<v1::PauseRequest, v1::PauseReply>& call);
  void on(Call<v1::ResumeRequest, v1::ResumeReply>& call);
  void on(Call<v1::SnapshotRequest, SnapshotChunks>& call);

 private:
  // What a request is to do, which is possible, and which the registry has done.
  struct Plan {
    std::optional<GivenCommands> given;
    v1::RecordedCommands recorded;
    AskedQueries queries;
  };
  absl::StatusOr<Plan> plan(const Call<v1::Request, v1::Reply>& call, bool is_new) const;
  absl::StatusOr<AskedQueries> checked_queries(const Call<v1::Request, v1::Reply>& call) const;
  std::function<void(const AskedQueries&, Nanoseconds, const absl::Status&)> account_of(
      const std::optional<ClientRole>& role) const;
  absl::Status room_for(const GivenCommands& given) const;

  const CoordinatorContext& context_;
  ActiveWorld& world_;
  const Nanoseconds now_;
};

}  // namespace tessera
