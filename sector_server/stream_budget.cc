#include "sector_server/stream_budget.h"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "proto/stream_limits.h"

namespace tessera {
namespace {

// What can be saved up, of a second: with the rest as the rate, no second has more than the budget.
constexpr double kSaved = 0.05;
constexpr double kRate = 1 - kSaved;

constexpr double kBatchBytes = 64;       // without bodies
constexpr double kFirstBodyBytes = 160;  // the most that the forms of batches take
constexpr double kForget = 0.1;          // how fast the estimate goes down; it goes up at once

}  // namespace

absl::Status check_budget(const v1::WatchBodiesRequest& request) {
  const std::uint64_t rate = request.bytes_per_second();
  if (rate == 0 || (rate >= kBytesPerSecondMin && rate <= kBytesPerSecondMax)) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("bytes_per_second = ", rate, " must be 0, or from ",
                                                 kBytesPerSecondMin, " to ", kBytesPerSecondMax,
                                                 " for each server"));
}

StreamBudget::StreamBudget(std::uint64_t bytes_per_second, Time now)
    : rate_(static_cast<double>(bytes_per_second)),
      last_(now),
      credit_(kSaved * rate_),
      body_bytes_(kFirstBodyBytes) {}

std::size_t StreamBudget::bodies(Time now) {
  if (rate_ == 0) return kAll;
  const std::lock_guard lock(mutex_);
  const double passed = std::max(std::chrono::duration<double>(now - last_).count(), 0.0);
  last_ = now;
  credit_ = std::min(credit_ + kRate * rate_ * passed, kSaved * rate_);
  return static_cast<std::size_t>(std::max((credit_ - kBatchBytes) / body_bytes_, 1.0));
}

std::size_t StreamBudget::reserve(std::size_t bodies) {
  if (rate_ == 0) return 0;
  const std::lock_guard lock(mutex_);
  const auto reserved = static_cast<std::size_t>(kBatchBytes + body_bytes_ * static_cast<double>(bodies));
  credit_ = std::max(credit_ - static_cast<double>(reserved), -rate_);
  return reserved;
}

void StreamBudget::sent(std::size_t reserved, std::size_t bytes, std::size_t bodies) {
  if (rate_ == 0) return;
  const std::lock_guard lock(mutex_);
  credit_ = std::max(credit_ + static_cast<double>(reserved) - static_cast<double>(bytes), -rate_);
  if (bodies == 0) return;
  const double each = (static_cast<double>(bytes) - kBatchBytes) / static_cast<double>(bodies);
  body_bytes_ = std::max({each, body_bytes_ + kForget * (each - body_bytes_), 1.0});
}

}  // namespace tessera
