#include "simulator/fault_schedule.h"

#include <algorithm>
#include <chrono>

#include "coordinator/coordinator.h"
#include "simulator/dice.h"

namespace tessera {
namespace {

constexpr std::uint32_t kFaultStream = 1;
constexpr std::uint64_t kSecond = 1'000'000'000;
constexpr std::uint64_t kMillisecond = 1'000'000;

std::uint64_t timeout_ns() {
  return static_cast<std::uint64_t>(CoordinatorOptions().server_timeout / std::chrono::nanoseconds(1));
}

// Heartbeats come once a second, and servers notice a second later than the coordinator.
constexpr std::uint64_t kMargin = 2 * kSecond;
constexpr std::uint64_t kRestartMax = 5 * kSecond;
constexpr std::uint64_t kDiskOperationsMax = 200;

// Short ones are spread over all magnitudes, from less than a tick to seconds.
std::uint64_t draw_length_ns(Dice& dice) {
  if (dice.one_in(4)) return dice.between(timeout_ns() + kMargin, 2 * timeout_ns());
  const std::uint64_t longest = (timeout_ns() - kMargin) >> dice.below(14);
  return dice.between(longest / 2, longest);
}

// How long a fault lasts.
std::uint64_t draw_duration_ns(FaultKind kind, Dice& dice) {
  switch (kind) {
    case FaultKind::kCut:
    case FaultKind::kStop:
      return draw_length_ns(dice);
    case FaultKind::kSlow:
    case FaultKind::kDiskFull:
    case FaultKind::kDiskFailing:
      return dice.between(10 * kMillisecond, 3 * kSecond);
    case FaultKind::kCrash:
    case FaultKind::kCoordinatorCrash:
    case FaultKind::kPowerLoss:
    case FaultKind::kCrashInRecovery:
      return dice.between(std::uint64_t{1}, kRestartMax);
    case FaultKind::kLastingCut:
    case FaultKind::kBreak:
    case FaultKind::kClockJump:
    case FaultKind::kJoin:
    case FaultKind::kDrain:
      return 0;
  }
  return 0;
}

std::uint64_t draw_amount(FaultKind kind, Dice& dice) {
  switch (kind) {
    case FaultKind::kLastingCut:
      return dice.below(kLastingCuts);
    case FaultKind::kSlow:
      return dice.between(kMillisecond, 20 * kMillisecond);
    case FaultKind::kClockJump:
      return dice.between(kMillisecond, 2 * timeout_ns());
    case FaultKind::kCoordinatorCrash:
    case FaultKind::kPowerLoss:
      return dice.one_in(2) ? 0 : dice.between(std::uint64_t{1}, kDiskOperationsMax);
    case FaultKind::kCrashInRecovery:
      return dice.below(20 * kMillisecond);
    default:
      return 0;
  }
}

}  // namespace

FaultSchedule draw_faults(std::uint64_t seed, const FaultNumbers& numbers, std::uint64_t begin_ns_max) {
  Dice dice(seed, kFaultStream);
  FaultSchedule faults;
  for (std::size_t kind = 0; kind < kFaultKinds; ++kind) {
    for (std::uint32_t n = 0; n < numbers[kind]; ++n) {
      Fault& fault = faults.emplace_back();
      fault.kind = static_cast<FaultKind>(kind);
      fault.begin_ns = dice.between(std::uint64_t{0}, begin_ns_max);
      fault.end_ns = fault.begin_ns + draw_duration_ns(fault.kind, dice);
      fault.pick = dice.below(UINT64_MAX);
      fault.amount = draw_amount(fault.kind, dice);
    }
  }
  std::stable_sort(faults.begin(), faults.end(),
                   [](const Fault& a, const Fault& b) { return a.begin_ns < b.begin_ns; });
  return faults;
}

}  // namespace tessera
