// What a stream of bodies may send in a second.
#pragma once

#include <absl/status/status.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <mutex>

#include "tessera.pb.h"

namespace tessera {

// INVALID_ARGUMENT, with the bounds, for a budget that no stream can have.
absl::Status check_budget(const v1::WatchBodiesRequest& request);

// A bucket of bytes that fills with wall time: in no second, more is sent than the budget. What a batch will
// take is estimated from those before it. One that takes more leaves a debt, of a second at most, which later
// ones pay. Safe to use from any thread.
class StreamBudget {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

  // 0: all bodies, always.
  StreamBudget(std::uint64_t bytes_per_second, Time now);

  // How many bodies the next batch may have: one at least.
  std::size_t bodies(Time now);
  // A batch of so many bodies is going to be sent: what it is expected to take, in bytes, for sent().
  std::size_t reserve(std::size_t bodies);
  // It has been serialised, and takes so many.
  void sent(std::size_t reserved, std::size_t bytes, std::size_t bodies);

 private:
  const double rate_;  // bytes a second
  std::mutex mutex_;   // guards the following
  Time last_;
  double credit_;      // bytes
  double body_bytes_;  // of a body, as estimated
};

}  // namespace tessera
