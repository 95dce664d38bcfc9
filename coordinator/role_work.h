// What requests of clients cost, by role, and the share of time that those of role observe may take.
#pragma once

#include <absl/status/status.h>

#include <array>
#include <chrono>
#include <cstdint>

#include "keys/role.h"

namespace tessera {

class RoleWork {
 public:
  using Nanoseconds = std::chrono::nanoseconds;

  struct Costs {
    std::uint64_t requests = 0;
    std::uint64_t refused = 0;  // since the role had used up its share, or would have
    Nanoseconds work{};         // of the coordinator and, for queries, of the server that took longest
  };
  using ByRole = std::array<Costs, kClientRoleCount>;

  // `observe_share`: of the time, above 0 and at most 1.
  explicit RoleWork(double observe_share) : observe_share_(observe_share), credit_ns_(credit_max()) {}

  // Counts a request. While a world ticks, RESOURCE_EXHAUSTED for one of role observe whose clients have used
  // up their share, with the share and when there is time for them again.
  absl::Status admit(ClientRole role, bool world_ticks, Nanoseconds now);
  // A request that was let in took so long, while the world ticked or not.
  void add_work(ClientRole role, Nanoseconds work, bool world_ticks);
  // A request that was let in was refused later, since it would have taken too long.
  void add_refusal(ClientRole role) { ++of(role).refused; }

  const ByRole& costs() const { return costs_; }

 private:
  Costs& of(ClientRole role) { return costs_[static_cast<std::size_t>(role)]; }
  double credit_max() const;

  double observe_share_;
  ByRole costs_ = {};
  Nanoseconds last_{};
  double credit_ns_;  // that role observe may take now; below 0: that it has taken too much
};

}  // namespace tessera
