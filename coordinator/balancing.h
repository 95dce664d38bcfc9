// Divides a world anew among its servers while it runs: the map follows the load. Moves are announced in
// grants, so that all servers make them at the beginning of the same tick; where a body lives does not change
// a bit of what comes out.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "coordinator/active_world.h"
#include "coordinator/balance.h"
#include "coordinator/consolidation.h"
#include "coordinator/context.h"

namespace tessera {

class Balancing {
 public:
  // Both must outlive this.
  Balancing(const CoordinatorContext& context, ActiveWorld& world) : context_(context), world_(world) {}
  Balancing(const Balancing&) = delete;
  Balancing& operator=(const Balancing&) = delete;

  // Plans by the loads that have come, and asks for the next ones when they are due.
  void tend(Nanoseconds now);
  std::optional<Nanoseconds> next_deadline() const;

  void answer(ClientCall<v1::BalanceRequest, v1::BalanceReply>& call);

  // Whether the last change of the map is over for all servers.
  bool has_settled() const;

  // A server has joined: the world is divided anew at once, one time after the other.
  void share_out();
  // The next step towards a server of that rank without sectors. True with the last one; before, call it
  // again whenever the map has settled.
  bool empty(Rank leaver);
  // The world goes back to a checkpoint, on other servers.
  void set_back();

  // To other servers, as planned, since the load.
  std::uint64_t moved_sectors() const { return moved_sectors_; }
  std::uint64_t moved_bodies() const { return moved_bodies_; }

 private:
  bool may_balance() const;
  bool may_share_out() const;
  void ask();
  v1::Question load_question(Questions::LoadReply reply);
  absl::StatusOr<std::vector<ServerLoad>> checked(const std::vector<v1::ServerLoad>& messages) const;
  void plan(const std::vector<ServerLoad>& loads);
  void set_map(const BalancePlan& plan);
  void set_map(const SectorMap& map, std::uint64_t moved_sectors, std::uint64_t moved_bodies);

  const CoordinatorContext& context_;
  ActiveWorld& world_;
  bool awaits_ = false;                               // loads of its servers
  std::optional<std::vector<v1::ServerLoad>> fresh_;  // that have just come
  Nanoseconds next_{};                                // the time
  std::uint32_t shares_left_ = 0;                     // how often at most it is divided anew at once
  Consolidation consolidation_;
  std::uint64_t moved_sectors_ = 0;
  std::uint64_t moved_bodies_ = 0;
};

}  // namespace tessera
