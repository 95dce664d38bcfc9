// How long ticks took.
#pragma once

namespace tessera {

// ms of work a tick, without pacing.
struct TickTimes {
  double mean = 0;
  double p50 = 0;
  double p99 = 0;
  double max = 0;

  friend bool operator==(const TickTimes&, const TickTimes&) = default;
};

}  // namespace tessera
