// Links: which servers a server talks to in each tick.
//
// Few servers all talk to each other. Of many, two are linked while they have told each other something in
// the last ticks; both have seen the same messages, in both directions, so both come to the same. Who has
// something for a server that it is not linked to says so in an agreement (agreement.h).
#pragma once

#include <absl/container/btree_map.h>

#include <cstdint>

#include "lpss/grid/sector_map.h"
#include "lpss/tick/messages.h"

namespace tessera {

// A link ends after so many ticks without anything to say.
inline constexpr Tick kLinkTicks = 64;

class Links {
 public:
  void clear() { last_.clear(); }

  // Something was sent in that tick, by either side.
  void note(Rank other, Tick tick) { last_[other] = tick; }

  void forget_old(Tick now) {
    absl::erase_if(last_, [now](const auto& link) { return link.second + kLinkTicks < now; });
  }

  bool contains(Rank other) const { return last_.contains(other); }
  std::size_t size() const { return last_.size(); }

  // Calls visit(rank) in ascending order.
  template <typename Visit>
  void for_each(Visit&& visit) const {
    for (const auto& [rank, tick] : last_) visit(rank);
  }

 private:
  absl::btree_map<Rank, Tick> last_;  // in which something was said
};

}  // namespace tessera
