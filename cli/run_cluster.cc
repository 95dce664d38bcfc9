#include "cli/run_cluster.h"

#include <absl/strings/str_cat.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "cli/interrupt.h"
#include "cli/local_cluster.h"
#include "cli/prepared_run.h"
#include "cli/terminal.h"
#include "tessera/client.h"

namespace tessera::cli {
namespace {

constexpr absl::Duration kShutdownTimeout = absl::Seconds(15);

absl::Status step(LocalCluster& cluster, Client& client, RunReport& report) {
  ProgressBar progress(absl::StrCat(report.servers, report.servers == 1 ? " server" : " servers"),
                       report.ticks);
  const Clock::time_point start = Clock::now();
  const auto step_all = [&] {
    return report.ticks == 0 ? absl::OkStatus() : client.step(report.ticks).status();
  };
  const auto show = [&] {
    // A coordinator that is too busy to answer is no failure of the run.
    if (const auto status = client.status(absl::Seconds(1)); status.ok()) progress.update(status->tick);
  };
  absl::Status status = progress.shown() ? cluster.attend(step_all, show) : cluster.attend(step_all);
  report.set_wall_time(seconds_since(start));
  return status;
}

absl::Status question(Client& client, RunReport& report) {
  const absl::StatusOr<ClusterStatus> status = client.status();
  if (!status.ok()) return status.status();
  const absl::StatusOr<HashAt> hash = client.hash();
  if (!hash.ok()) return hash.status();
  if (const Tick last = report.first_tick + report.ticks; hash->tick != last) {
    return absl::InternalError(absl::StrCat("the world is at tick ", hash->tick, " and not at ", last));
  }
  report.world_hash = hash->hash;
  report.sectors = status->counts.sectors;
  report.counts = status->counts_since_load;
  report.divergences = status->divergences;
  report.tick_ms = status->tick_ms;
  return absl::OkStatus();
}

void measure_memory(const LocalCluster& cluster, RunReport& report) {
  auto& peaks = report.peak_rss_mb_by_process;
  peaks.emplace_back("tessera", peak_rss_mb(getpid()));
  peaks.emplace_back("coordinator", peak_rss_mb(cluster.coordinator()));
  for (int place = 0; place < report.servers; ++place) {
    const double peak = peak_rss_mb(cluster.server(static_cast<std::size_t>(place)));
    peaks.emplace_back(absl::StrCat("sector_server_", place + 1), peak);
  }
  for (const auto& [process, peak] : peaks) report.peak_rss_mb = std::max(report.peak_rss_mb, peak);
}

}  // namespace

absl::StatusOr<RunReport> run_cluster(const RunOptions& options) {
  absl::StatusOr<PreparedRun> run = prepare(options, "cluster");
  if (!run.ok()) return run.status();
  RunReport& report = run->report;
  const WorldDescription& world = run->loaded.world;

  LocalClusterOptions cluster_options;
  cluster_options.servers = options.servers;
  cluster_options.precision = report.settings.precision;
  cluster_options.threads = report.threads;
  cluster_options.interrupt_descriptor = interrupt_descriptor();
  absl::StatusOr<std::unique_ptr<LocalCluster>> cluster = LocalCluster::start(cluster_options);
  if (!cluster.ok()) return cluster.status();
  absl::StatusOr<std::unique_ptr<Client>> client = Client::connect((*cluster)->address());
  if (!client.ok()) return client.status();
  const auto load = [&] {
    return run->snapshot ? (*client)->restore(options.from).status() : (*client)->load(world).status();
  };
  absl::Status status = (*cluster)->attend(load);
  if (!status.ok()) return status;
  report.load_seconds = seconds_since(run->begin);

  status = step(**cluster, **client, report);
  if (status.ok()) status = question(**client, report);
  if (!status.ok()) return status;
  measure_memory(**cluster, report);
  if (!options.snapshot.empty()) {
    if (status = (*client)->snapshot(options.snapshot).status(); !status.ok()) return status;
  }
  if (status = (*client)->shutdown(); !status.ok()) return status;
  if (status = (*cluster)->wait_until_ended(kShutdownTimeout); !status.ok()) return status;
  return std::move(report);
}

}  // namespace tessera::cli
