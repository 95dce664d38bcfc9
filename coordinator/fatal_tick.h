// Which tick ends the servers that carry it out.
#pragma once

#include <algorithm>
#include <optional>

#include "lpss/tick/messages.h"

namespace tessera {

// Ticks that were granted and not completed.
struct TicksUnderWay {
  Tick first = 0;
  Tick last = 0;
};

// A tick is fatal where the processes of kFatalEnds servers, one after the other, have ended while it was
// under way, and the last ones while no other tick was. While a tick is suspected, ticks are repeated one by
// one.
class FatalTick {
 public:
  // The process of a server has ended. `under_way`: nothing while no server carries out any tick.
  void on_end(const std::optional<TicksUnderWay>& under_way) {
    if (!under_way) return;
    if (ends_ > 0 && under_way->first <= suspects_.last && suspects_.first <= under_way->last) {
      suspects_ = {std::max(under_way->first, suspects_.first), std::min(under_way->last, suspects_.last)};
      ++ends_;
    } else {
      suspects_ = *under_way;
      ends_ = 1;
    }
  }

  // Whether a tick after `completed` may be fatal.
  bool suspects_beyond(Tick completed) const { return ends_ > 0 && suspects_.last > completed; }

  std::optional<Tick> found() const {
    return ends_ >= kFatalEnds && suspects_.first == suspects_.last ? std::optional(suspects_.first)
                                                                    : std::nullopt;
  }

 private:
  static constexpr int kFatalEnds = 3;

  TicksUnderWay suspects_;
  int ends_ = 0;  // in a row that they have in common
};

}  // namespace tessera
