#include "simulator/fault_schedule.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "coordinator/coordinator.h"
#include "simulator/dice.h"

namespace tessera {
namespace {

constexpr std::uint32_t kFaultStream = 1;
constexpr std::uint64_t kSecond = 1'000'000'000;

std::uint64_t timeout_ns() {
  return static_cast<std::uint64_t>(CoordinatorOptions().server_timeout / std::chrono::nanoseconds(1));
}

// Heartbeats come once a second, and servers notice a second later than the coordinator.
constexpr std::uint64_t kMargin = 2 * kSecond;
constexpr std::uint64_t kRestartMax = 5 * kSecond;

// Short cuts are spread over all magnitudes, from less than a tick to seconds.
std::uint64_t draw_length_ns(Dice& dice) {
  if (dice.one_in(4)) return dice.between(timeout_ns() + kMargin, 2 * timeout_ns());
  const std::uint64_t longest = (timeout_ns() - kMargin) >> dice.below(14);
  return dice.between(longest / 2, longest);
}

template <typename T>
T take_any(Dice& dice, std::vector<T>& from) {
  std::swap(from[dice.below(from.size())], from.back());
  const T taken = from.back();
  from.pop_back();
  return taken;
}

}  // namespace

FaultSchedule draw_faults(std::uint64_t seed, const FaultOptions& options, std::span<const NodeId> servers) {
  Dice dice(seed, kFaultStream);
  std::vector<std::pair<NodeId, NodeId>> links;
  for (std::size_t i = 0; i < servers.size(); ++i) {
    links.emplace_back(kCoordinatorNode, servers[i]);
    for (std::size_t j = i + 1; j < servers.size(); ++j) links.emplace_back(servers[i], servers[j]);
  }
  FaultSchedule faults;
  while (faults.cuts.size() < options.cuts && !links.empty()) {
    const auto [node, peer] = take_any(dice, links);
    const std::uint64_t begin_ns = dice.between(std::uint64_t{0}, options.begin_ns_max);
    faults.cuts.push_back({node, peer, begin_ns, begin_ns + draw_length_ns(dice)});
  }
  std::vector<NodeId> alive(servers.begin(), servers.end());
  while (faults.crashes.size() < options.crashes && !alive.empty()) {
    const std::uint64_t time_ns = dice.between(std::uint64_t{0}, options.begin_ns_max);
    faults.crashes.push_back(
        {take_any(dice, alive), time_ns, time_ns + dice.between(std::uint64_t{0}, kRestartMax)});
  }
  std::uint64_t from_ns = 0;
  for (std::uint32_t n = 0; n < options.coordinator_crashes; ++n) {
    const std::uint64_t time_ns = from_ns + dice.between(std::uint64_t{1}, options.begin_ns_max);
    from_ns = time_ns + dice.between(std::uint64_t{1}, kRestartMax);
    faults.coordinator_crashes.push_back({time_ns, from_ns});
  }
  return faults;
}

}  // namespace tessera
