// What a sector server reports of its ticks.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "cluster.pb.h"
#include "lpss/tick/tick_machine.h"
#include "sector_server/tick_meter.h"

namespace tessera {

// Reports are sent in bundles: they only open the window of grants.
class TickReports {
 public:
  // `hashes`: with the hash of each tick.
  explicit TickReports(bool hashes) : hashes_(hashes) {}

  void add(Tick tick, const TickMachine& machine, const TickMeter::Times& times);

  // The last one; of tick 0 before the first.
  const v1::TickReport& last() const { return last_; }
  // Whether they should be sent; `idle`: nothing else is to come for now.
  bool are_due(bool idle) const { return waiting_.size() >= kTicksPerReport || (idle && !waiting_.empty()); }
  // Those since the last call.
  std::vector<v1::TickReport> take() { return std::exchange(waiting_, {}); }

 private:
  static constexpr std::size_t kTicksPerReport = 8;

  const bool hashes_;
  std::vector<v1::TickReport> waiting_;
  v1::TickReport last_;
};

}  // namespace tessera
