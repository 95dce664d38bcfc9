#include "experiments/scale/scale.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "cli/interrupt.h"
#include "experiments/local_servers.h"
#include "experiments/scale/crowd.h"
#include "experiments/scale/neighbours.h"
#include "lpss/simulation/partition_cluster.h"

namespace tessera {
namespace {

constexpr double kLookEvery = 0.5;  // s
constexpr double kLookAhead = 2;    // s

struct Entrant {
  std::string name;
  Sharing sharing;
};

std::vector<Entrant> entrants() {
  std::vector<Entrant> all = {{"none", {}}, {"grid", {.policy = BalancePolicy::kGrid, .every = kLookEvery}}};
  for (const BalancePolicy policy : kBalancePolicies) {
    if (!follows_load(policy)) continue;
    for (const double ahead : {0.0, kLookAhead}) {
      all.push_back({std::string(name_of(policy)), {.policy = policy, .every = kLookEvery, .ahead = ahead}});
    }
  }
  return all;
}

const char* name_of(Layout layout) {
  switch (layout) {
    case Layout::kRow:
      return "row";
    case Layout::kPlane:
      return "plane";
    case Layout::kJointedRow:
      return "jointed row";
  }
  return "";
}

// A world that grows with its servers, in partitions of one process.
absl::Status measure_partitions(const ExperimentOptions& options, Layout layout, int servers,
                                std::uint32_t all_linked_max, Report& report) {
  constexpr Tick kTicks = 40;
  const absl::StatusOr<NeighboursRun> run = run_neighbours(
      neighbours_world(layout, servers, options.precision), static_cast<std::uint32_t>(servers),
      all_linked_max, kTicks, [] { return !cli::interrupted(); });
  if (!run.ok()) return run.status();
  const bool links = servers > static_cast<int>(all_linked_max);
  const std::string layout_name = name_of(layout);
  if (run->hash != run->hash_of_one)
    report.misses.push_back(absl::StrCat(layout_name, " of ", servers, ": other bits than one process"));
  Row row = {{"engine", name_of(options.precision)},
             {"layout", layout_name},
             {"servers", servers},
             {"talk_to", links ? "neighbours" : "all"},
             {"messages", run->messages.mean},
             {"messages_largest", run->messages.largest},
             {"kb", run->bytes.mean / 1000},
             {"kb_largest", run->bytes.largest / 1000},
             {"peers", run->peers.mean},
             {"peers_largest", run->peers.largest},
             {"heap_kb", run->heap_kb},
             {"joints_largest", run->joints.largest},
             {"same_bits", run->hash == run->hash_of_one}};
  for (std::size_t n = 0; n < kRoundNames.size(); ++n) {
    row[absl::StrCat(kRoundNames[n], "_messages")] = run->messages_by_round[n];
    row[absl::StrCat(kRoundNames[n], "_kb")] = run->bytes_by_round[n] / 1000;
  }
  report.table("neighbours").push_back(std::move(row));
  return absl::OkStatus();
}

// The same in processes.
absl::Status measure_processes(const ExperimentOptions& options, int servers, Report& report) {
  constexpr Tick kTicks = 40;
  const WorldDescription world = neighbours_world(Layout::kRow, servers, options.precision);
  auto one = PartitionCluster::create(world, 1);
  if (!one.ok()) return one.status();
  for (Tick tick = 0; tick < 2 * kTicks; ++tick) (*one)->step();
  auto started = experiments::LocalServers::start(servers, options.precision, /*checkpoint_every=*/{},
                                                  /*balance_every=*/{});
  if (!started.ok()) return started.status();
  Client& client = (*started)->client();
  if (auto loaded = client.load(world, /*replace=*/true); !loaded.ok()) return loaded.status();
  if (auto stepped = client.step(kTicks); !stepped.ok()) return stepped.status();
  const absl::StatusOr<ClusterStatus> before = client.status();
  if (!before.ok()) return before.status();
  const double coordinator_before = (*started)->coordinator_us();
  if (auto stepped = client.step(kTicks); !stepped.ok()) return stepped.status();
  const double coordinator_us = ((*started)->coordinator_us() - coordinator_before) / kTicks;
  const absl::StatusOr<ClusterStatus> after = client.status();
  if (!after.ok()) return after.status();
  const absl::StatusOr<HashAt> hash = client.hash();
  if (!hash.ok()) return hash.status();
  const bool same = hash->hash == (*one)->hash().to_string();
  if (!same) report.misses.push_back(absl::StrCat(servers, " processes: other bits than one process"));
  double messages = 0;
  double messages_largest = 0;
  double bytes = 0;
  double bytes_largest = 0;
  double memory = 0;
  double memory_largest = 0;
  for (std::size_t n = 0; n < after->servers.size(); ++n) {
    const ServerStatus& now = after->servers[n];
    const ServerStatus& then = before->servers[n];
    const auto sent = static_cast<double>(now.exchange_messages - then.exchange_messages) / kTicks;
    const auto sent_bytes = static_cast<double>(now.exchange_bytes - then.exchange_bytes) / kTicks;
    messages += sent / servers;
    bytes += sent_bytes / servers;
    memory += static_cast<double>(now.peak_rss_bytes) / servers;
    messages_largest = std::max(messages_largest, sent);
    bytes_largest = std::max(bytes_largest, sent_bytes);
    memory_largest = std::max(memory_largest, static_cast<double>(now.peak_rss_bytes));
  }
  report.table("processes")
      .push_back({{"engine", name_of(options.precision)},
                  {"servers", servers},
                  {"talk_to", servers > static_cast<int>(kAllLinkedMax) ? "neighbours" : "all"},
                  {"sent_messages", messages},
                  {"sent_messages_largest", messages_largest},
                  {"sent_kb", bytes / 1000},
                  {"sent_kb_largest", bytes_largest / 1000},
                  {"peak_rss_mb", memory / 1e6},
                  {"peak_rss_mb_largest", memory_largest / 1e6},
                  {"coordinator_us", coordinator_us},
                  {"same_bits", same}});
  return absl::OkStatus();
}

// `run`: "group name".
bool is_wanted(const ExperimentOptions& options, const std::string& run) {
  return absl::StrContains(run, options.only);
}

absl::Status measure_neighbours(const ExperimentOptions& options, const Progress& progress, Report& report) {
  std::vector<std::function<absl::Status()>> runs;
  for (const Layout layout : {Layout::kRow, Layout::kPlane, Layout::kJointedRow}) {
    for (const int servers : {2, 4, 8, 16, 32, 64, 128, 256, 512, 1024}) {
      if (!is_wanted(options, absl::StrCat(name_of(layout), " ", servers)) || (options.quick && servers > 16))
        continue;
      // For comparison; more would take long.
      if (servers <= 64) {
        runs.emplace_back([&options, &report, layout, servers] {
          return measure_partitions(options, layout, servers, static_cast<std::uint32_t>(servers), report);
        });
      }
      runs.emplace_back([&options, &report, layout, servers] {
        return measure_partitions(options, layout, servers, 1, report);
      });
    }
  }
  for (const int servers : {2, 4, 8, 16, 64}) {
    if (!is_wanted(options, absl::StrCat("processes ", servers)) || (options.quick && servers > 4)) continue;
    runs.emplace_back([&options, &report, servers] { return measure_processes(options, servers, report); });
  }
  ProgressCount count(progress, runs.size(), report);
  for (const auto& run : runs) {
    if (absl::Status status = run(); !status.ok()) return status;
    if (absl::Status status = count.advance(); !status.ok()) return status;
  }
  return absl::OkStatus();
}

// A crowd by each policy whose "scene policy" is wanted, into a table.
absl::Status measure_crowd(const ExperimentOptions& options, const WorldDescription& world, Tick ticks,
                           const std::string& scene, const std::string& table, const Progress& progress,
                           Report& report) {
  std::vector<Entrant> wanted = entrants();
  std::erase_if(wanted,
                [&](const Entrant& one) { return !is_wanted(options, absl::StrCat(scene, " ", one.name)); });
  ProgressCount count(progress, wanted.size(), report);
  std::string first;
  for (const Entrant& one : wanted) {
    const absl::StatusOr<CrowdRun> run =
        run_crowd(world, ticks, one.sharing, [] { return !cli::interrupted(); });
    if (!run.ok()) return run.status();
    if (first.empty()) first = run->hash;
    const bool same = run->hash == first;
    if (!same) report.misses.push_back(absl::StrCat(scene, " ", one.name, ": other bits than the first run"));
    report.table(table).push_back({{"engine", name_of(options.precision)},
                                   {"policy", one.name},
                                   {"ahead_s", one.sharing.ahead},
                                   {"largest_ms", run->largest_ms},
                                   {"mean_ms", run->mean_ms},
                                   {"largest_to_mean", run->largest_ms / run->mean_ms},
                                   {"largest_p99_ms", run->largest_p99_ms},
                                   {"late", run->late},
                                   {"ticks", ticks},
                                   {"real_time_factor", run->real_time_factor},
                                   {"moves", run->moves},
                                   {"moved_sectors", run->moved_sectors},
                                   {"moved_bodies", run->moved_bodies},
                                   {"moved_kb", run->moved_kb},
                                   {"exchanged_kb_per_tick", run->exchanged_kb},
                                   {"same_bits", same},
                                   {"hash", run->hash}});
    if (absl::Status status = count.advance(); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status measure_crossing(const ExperimentOptions& options, const Progress& progress, Report& report) {
  CrowdOptions crowd{.precision = options.precision};
  if (options.quick) {
    crowd.bodies = 600;
    crowd.ticks = 120;
  }
  return measure_crowd(options, crowd_world(crowd), crowd.ticks, "crowd", "rows", progress, report);
}

absl::Status measure_walk(const ExperimentOptions& options, const Progress& progress, Report& report) {
  CrowdOptions crowd{.precision = options.precision, .ticks = kWalkTicks};
  if (options.quick) {
    crowd.bodies = 600;
    crowd.ticks = 600;
  }
  return measure_crowd(options, walk_world(crowd), crowd.ticks, "walk", "walk", progress, report);
}

}  // namespace

absl::StatusOr<Report> measure_scale(const ExperimentOptions& options, const Progress& progress) {
  Report report;
  if (absl::Status status = measure_crossing(options, progress, report); !status.ok()) return status;
  if (options.only.starts_with("walk")) {
    if (absl::Status status = measure_walk(options, progress, report); !status.ok()) return status;
  }
  if (absl::Status status = measure_neighbours(options, progress, report); !status.ok()) return status;
  if (report.tables.empty())
    return absl::NotFoundError(absl::StrCat("No run's \"group name\" contains \"", options.only, "\"."));
  return report;
}

}  // namespace tessera
