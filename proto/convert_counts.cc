#include "proto/convert_counts.h"

#include <algorithm>

namespace tessera {

void write(const TickCounts& counts, CountsByPlace& message) {
  message.Clear();
  for (const TickCounter& counter : kTickCounters) message.Add(counts.*counter.value);
}

void write(const TickCounts& counts, CountsByName& message) {
  for (const TickCounter& counter : kTickCounters) message[counter.name] = counts.*counter.value;
}

TickCounts counts_from(const CountsByPlace& message) {
  TickCounts counts;
  const std::size_t known = std::min(kTickCounters.size(), static_cast<std::size_t>(message.size()));
  for (std::size_t n = 0; n < known; ++n) counts.*kTickCounters[n].value = message[static_cast<int>(n)];
  return counts;
}

TickCounts counts_from(const CountsByName& message) {
  TickCounts counts;
  for (const TickCounter& counter : kTickCounters) {
    if (const auto found = message.find(counter.name); found != message.end())
      counts.*counter.value = found->second;
  }
  return counts;
}

void write(const TickTimes& times, v1::TickTimes& message) {
  message.set_mean(times.mean);
  message.set_p50(times.p50);
  message.set_p99(times.p99);
  message.set_max(times.max);
}

TickTimes times_from(const v1::TickTimes& message) {
  return {.mean = message.mean(), .p50 = message.p50(), .p99 = message.p99(), .max = message.max()};
}

}  // namespace tessera
