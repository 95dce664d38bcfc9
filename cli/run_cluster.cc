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

// What a server keeps for one client is bounded (sector_server/subscription.h), so that a trajectory without
// gaps is read after so many ticks, and samples of bodies, at the most.
constexpr std::uint64_t kFramesBetweenReads = 64;
constexpr std::uint64_t kSamplesBetweenReads = 100'000;

absl::Status read_tick(Tick tick, BodyStream& stream, Trajectory& trajectory) {
  const absl::StatusOr<BodyFrame> frame = stream.next(kCallTimeout);
  if (!frame.ok()) return frame.status();
  if (frame->tick != tick) {
    return absl::InternalError(
        absl::StrCat("--trajectory: tick ", frame->tick, " came in the place of ", tick));
  }
  for (const BodySample& body : frame->bodies) trajectory.add(tick, body);
  return absl::OkStatus();
}

// Steps, and reads what the trajectory wants.
absl::Status step_and_read(Client& client, Trajectory& trajectory, const RunReport& report) {
  BodyFilter filter;
  filter.ids = trajectory.ids();
  filter.every_ticks = trajectory.every();
  filter.complete = true;
  const absl::StatusOr<std::unique_ptr<BodyStream>> stream = client.watch_bodies(filter);
  if (!stream.ok()) return stream.status();
  const std::uint64_t bodies = std::max<std::uint64_t>(trajectory.ids().size(), 1);
  const std::uint64_t ticks =
      trajectory.every() * std::clamp<std::uint64_t>(kSamplesBetweenReads / bodies, 1, kFramesBetweenReads);
  const Tick last = report.first_tick + report.ticks;
  Tick done = report.first_tick;
  for (Tick next = done;; next += trajectory.every() - next % trajectory.every()) {
    while (done < std::min(next, last)) {
      const std::uint64_t more = std::min(ticks, last - done);
      if (absl::Status status = client.step(more).status(); !status.ok()) return status;
      done += more;
    }
    if (next > last) return absl::OkStatus();
    if (absl::Status status = read_tick(next, **stream, trajectory); !status.ok()) return status;
  }
}

absl::Status step(LocalCluster& cluster, Client& client, Trajectory* trajectory, RunReport& report) {
  ProgressBar progress(absl::StrCat(report.servers, report.servers == 1 ? " server" : " servers"),
                       report.ticks);
  const Clock::time_point start = Clock::now();
  const auto step_all = [&] {
    if (trajectory != nullptr) return step_and_read(client, *trajectory, report);
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
  report.program_hash = hash->programs;
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

  status = step(**cluster, **client, run->trajectory.get(), report);
  if (status.ok() && run->trajectory) status = run->trajectory->finish();
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
