// Durations and counts of ticks, summed over the servers of a world.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/container/btree_set.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "cluster.pb.h"
#include "lpss/model/divergence.h"
#include "lpss/model/tick_counts.h"
#include "lpss/model/tick_times.h"
#include "lpss/observe/world_hash.h"
#include "lpss/tick/messages.h"
#include "transport/link.h"

namespace tessera {

// Counts durations in buckets no wider than 1/128 of their value: any number of ticks in 60 KB.
class DurationHistogram {
 public:
  void add(std::uint64_t microseconds);

  // All 0 if there are none.
  TickTimes times() const;

  std::uint64_t count() const { return count_; }
  double sum_s() const { return static_cast<double>(sum_us_) / 1e6; }

 private:
  // The quantile `share` (0 to 1), ms; 0 if there are none.
  double quantile_ms(double share) const;
  double max_ms() const { return static_cast<double>(max_us_) / 1e3; }

  std::vector<std::uint64_t> buckets_;
  std::uint64_t count_ = 0;
  std::uint64_t sum_us_ = 0;
  std::uint64_t max_us_ = 0;
};

// One tick of the whole world: `work_us` is that of the slowest server, the rest are sums.
struct TickSums {
  Tick tick = 0;
  std::uint64_t work_us = 0;
  TickCounts counts;
  WorldHash hash;      // empty unless the world hashes its ticks
  WorldHash programs;  // likewise, of programs
  std::vector<NodeId> heard_from;
  std::vector<Divergence> divergences;  // the first ones of each server
};

class TickStatistics {
 public:
  explicit TickStatistics(std::span<const NodeId> servers) { restart(servers); }

  // The world goes on, set back, on these servers. Ticks that were complete do not count again.
  void restart(std::span<const NodeId> servers);

  // The world has these servers from tick `since` on, which none of them has reported.
  void change_servers(Tick since, std::span<const NodeId> servers);

  // Reports may come in any order, each once; also of a server that has left, of the ticks before. Returns
  // the tick if this was the last server to report it.
  std::optional<TickSums> add(NodeId server, const v1::TickReport& report);

  const TickSums& last() const { return last_; }  // the latest tick that all servers have reported
  // Over all ticks that all servers have reported.
  const TickCounts& counts_since_load() const { return counts_since_load_; }
  const DurationHistogram& durations() const { return durations_; }
  // The first kDivergencesKept since the load, ascending.
  const std::vector<Divergence>& divergences() const { return divergences_; }

  // The figures of one of the servers.
  const v1::TickReport& last_of(NodeId server) const { return servers_.at(server).last; }
  const DurationHistogram& durations_of(NodeId server) const { return servers_.at(server).durations; }
  // The duration of its own part of a tick, without waiting for other servers: a mean of the last ticks.
  double own_ms_of(NodeId server) const { return servers_.at(server).own_us / 1e3; }
  // The server for which the others wait most of each tick, if it has been one for some ticks; not one that
  // alone has anything awake.
  std::optional<NodeId> slow() const { return slow_; }

 private:
  struct OfServer {
    v1::TickReport last;
    DurationHistogram durations;
    double own_us = 0;
  };

  std::size_t servers_at(Tick tick) const;
  void complete(const TickSums& sums);
  void look_for_slow();

  std::map<NodeId, OfServer> servers_;
  std::map<Tick, std::size_t> counts_;       // of servers, from a tick on
  absl::btree_map<Tick, TickSums> partial_;  // some servers have reported, others have not
  absl::btree_set<Tick> whole_;              // the last ones of those that all have reported
  TickSums last_;
  TickCounts counts_since_load_;
  DurationHistogram durations_;
  std::vector<Divergence> divergences_;
  std::uint64_t ticks_since_restart_ = 0;
  std::optional<NodeId> slow_;
};

// Simulated time per wall time: over the last two seconds while the world runs, over the whole last run once
// it is paused.
class RealTimeMeter {
 public:
  using Nanoseconds = std::chrono::nanoseconds;

  void start(Tick tick, Nanoseconds now);
  void progress(Tick tick, Nanoseconds now);
  void stop(Tick tick, Nanoseconds now);
  double factor(double time_step, Nanoseconds now) const;

 private:
  struct Mark {
    Tick tick = 0;
    Nanoseconds time{};
  };

  std::optional<Mark> started_;
  std::optional<Mark> stopped_;
  std::deque<Mark> marks_;  // of the last two seconds, thinned out
  Tick tick_ = 0;
};

}  // namespace tessera
