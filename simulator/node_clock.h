// The clock of a simulated process: it begins anywhere, drifts, and may jump ahead.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>

#include "simulator/dice.h"

namespace tessera {

class NodeClock {
 public:
  using Nanoseconds = std::chrono::nanoseconds;

  explicit NodeClock(Dice& dice)
      : offset_ns_(static_cast<std::int64_t>(dice.below(kOffsetMaxNs))),
        drift_(dice.between(-kDriftMax, kDriftMax)) {}

  // What it shows at a time of the network; never goes back.
  Nanoseconds at(std::uint64_t network_ns) const {
    const auto drifted_ns = static_cast<std::int64_t>(static_cast<double>(network_ns) * drift_);
    return Nanoseconds(offset_ns_ + static_cast<std::int64_t>(network_ns) + drifted_ns);
  }

  // When it will show `time` or more.
  std::uint64_t when(Nanoseconds time) const {
    auto network_ns = static_cast<std::uint64_t>(
        std::max(0.0, static_cast<double>(time.count() - offset_ns_) / (1 + drift_)));
    while (at(network_ns) < time)
      network_ns += 1 + static_cast<std::uint64_t>((time - at(network_ns)).count());
    return network_ns;
  }

  void jump(std::uint64_t ahead_ns) { offset_ns_ += static_cast<std::int64_t>(ahead_ns); }

 private:
  static constexpr std::uint64_t kOffsetMaxNs = 1'000'000'000'000;
  static constexpr double kDriftMax = 0.005;  // far more than clocks do

  std::int64_t offset_ns_;
  double drift_;
};

}  // namespace tessera
