// Metrics of a sector server: counts of its last tick, and the durations of its ticks.
#pragma once

#include <absl/status/status.h>
#include <prometheus/counter.h>
#include <prometheus/family.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "cluster.pb.h"
#include "lpss/model/tick_counts.h"
#include "sector_server/options.h"
#include "sector_server/world_run.h"

namespace tessera {

// Written by the thread that owns the server, readable from any thread.
class ServerMetrics {
 public:
  explicit ServerMetrics(const SectorServerArguments& arguments);

  // After each tick, and after a load (`tick` is null then).
  void show(const v1::TickReport* tick, std::size_t bodies, const WorldRun::Traffic& traffic);
  // Of this process: tiles of ground, their bytes, and those that a tick had to wait for so far.
  void show_ground(std::uint64_t tiles, std::uint64_t bytes, std::uint64_t waits);
  void set_joined(bool joined);

  std::vector<prometheus::MetricFamily> collect() const { return registry_.Collect(); }
  // UNAVAILABLE until a coordinator has accepted the server, and while that coordinator does not respond.
  absl::Status ready() const;

 private:
  prometheus::Gauge& gauge(const std::string& name, const std::string& help);
  prometheus::Counter& counter(const std::string& name, const std::string& help);

  prometheus::Registry registry_;
  prometheus::Gauge& joined_;
  prometheus::Gauge& tick_;
  prometheus::Counter& ticks_;
  prometheus::Histogram& tick_duration_;
  prometheus::Counter& own_time_;
  prometheus::Gauge& bodies_;
  // By their places in kTickCounters: gauges of what there is, counters of what happens; the other is null.
  struct OfCounter {
    prometheus::Gauge* level = nullptr;
    prometheus::Counter* total = nullptr;
  };
  std::array<OfCounter, kTickCounters.size()> counts_;
  prometheus::Counter& exchange_;
  prometheus::Gauge& ground_tiles_;
  prometheus::Gauge& ground_bytes_;
  prometheus::Counter& ground_waits_;
  // By the kind of round.
  struct OfRounds {
    explicit OfRounds(prometheus::Family<prometheus::Counter>& messages,
                      prometheus::Family<prometheus::Counter>& bytes, const std::string& direction);
    // Since the last update, or a load.
    void show(const TrafficByRound& traffic);

    std::array<prometheus::Counter*, kRoundNames.size()> messages;
    std::array<prometheus::Counter*, kRoundNames.size()> bytes;
    TrafficByRound last{};
  };
  prometheus::Family<prometheus::Counter>& round_messages_;
  prometheus::Family<prometheus::Counter>& round_bytes_;
  OfRounds sent_;
  OfRounds received_;
};

}  // namespace tessera
