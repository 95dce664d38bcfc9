// Whether a world is better off on one server than divided.
#pragma once

#include <chrono>
#include <optional>
#include <span>

#include "coordinator/balance.h"

namespace tessera {

// A tick of a divided world takes as long as its slowest server works, and as that waits for the others; and
// some work along borders is done twice. A world that is light may be done sooner on one server. How much
// sooner is known once it has been there: what was measured divided and on one server is compared from then
// on.
class Consolidation {
 public:
  // What a world that follows its load does next; to be asked at every look at its load. Where ticks are to
  // be shorter, and would take no longer on one server, all that is awake goes there, and the rest stays
  // where it is. From there it is divided by the policy where it gains by that, and so is a world that is
  // better off divided. Nothing moves where that is not worth its trouble. `period`: from one tick to the
  // next in real time, of a world that is to keep it.
  BalancePlan next(const SectorMap& map, std::span<const ServerLoad> loads, BalancePolicy policy,
                   std::chrono::duration<double, std::micro> time_step,
                   std::optional<std::chrono::duration<double, std::micro>> period);

 private:
  // On one server, as last measured: of a unit of work, us by a server of the mean capacity.
  std::optional<double> alone_us_;
  // A tick when it was last divided, us, if it has just gone to one server.
  std::optional<double> divided_us_;
  // How much longer a tick takes divided than its slowest server's share of what one alone does, us.
  double extra_us_ = 0;
};

}  // namespace tessera
