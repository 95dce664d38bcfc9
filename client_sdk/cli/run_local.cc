#include "client_sdk/cli/run_local.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>

#include "client_sdk/cli/interrupt.h"
#include "client_sdk/cli/terminal.h"
#include "experiments/plain_world.h"
#include "lpss/world/simulation.h"

namespace tessera::cli {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Steps, measures each tick, and leaves the times in the report.
absl::Status step_all(const std::string& what, const std::function<void()>& step, RunReport& report) {
  std::vector<double> milliseconds;
  milliseconds.reserve(std::min<std::uint64_t>(report.ticks, 10'000'000));
  ProgressBar progress(what, report.ticks);
  const Clock::time_point start = Clock::now();
  for (std::uint64_t tick = 0; tick < report.ticks; ++tick) {
    if (interrupted()) return absl::CancelledError("interrupted");
    const Clock::time_point tick_start = Clock::now();
    step();
    milliseconds.push_back(seconds_since(tick_start) * 1e3);
    progress.update(tick + 1);
  }
  report.wall_seconds = seconds_since(start);
  const double simulated = static_cast<double>(report.ticks) * report.dt;
  report.real_time_factor = report.wall_seconds > 0 ? simulated / report.wall_seconds : 0;
  report.tick_ms = tick_times(std::move(milliseconds));
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<RunReport> run_in_process(const RunOptions& options) {
  const Clock::time_point load_start = Clock::now();
  const absl::StatusOr<LoadedWorld> loaded = load_world(options.world, options.overrides);
  if (!loaded.ok()) return loaded.status();
  const absl::StatusOr<std::uint64_t> ticks = ticks_of(options.seconds, loaded->world.settings.time_step);
  if (!ticks.ok()) return ticks.status();
  RunReport report;
  report.mode = "in-process";
  report.describe(*loaded, options, *ticks);
  absl::StatusOr<std::unique_ptr<Simulation>> simulation = Simulation::create(loaded->world, report.threads);
  if (!simulation.ok()) return simulation.status();
  const absl::StatusOr<std::vector<BodyRecord>> start = records_of(loaded->world);
  if (!start.ok()) return start.status();
  Towers towers(loaded->world, *start);
  report.load_seconds = seconds_since(load_start);

  const auto step = [&] {
    (*simulation)->step();
    const TickCounts& counts = (*simulation)->counts();
    report.sectors = counts.sectors;
    report.clones_max = std::max<std::uint64_t>(report.clones_max, counts.clones);
    report.islands_across_seams =
        std::max<std::uint64_t>(report.islands_across_seams, counts.islands_across_seams);
    report.islands_shipped =
        std::max<std::uint64_t>(report.islands_shipped.value_or(0), counts.islands_shipped);
    report.bodies_stopped += counts.bodies_stopped;
  };
  if (absl::Status status = step_all("in-process", step, report); !status.ok()) return status;

  report.world_hash = (*simulation)->hash().to_string();
  (*simulation)->share().for_each_body([&](const BodyRecord& record) { towers.set_end(record); });
  if (!towers.empty()) report.towers = towers.report();
  report.peak_rss_mb = peak_rss_mb(getpid());
  report.peak_rss_mb_by_process = {{"tessera", report.peak_rss_mb}};
  return report;
}

absl::StatusOr<RunReport> run_plain(const RunOptions& options) {
  const Clock::time_point load_start = Clock::now();
  const absl::StatusOr<LoadedWorld> loaded = load_world(options.world, options.overrides);
  if (!loaded.ok()) return loaded.status();
  const absl::StatusOr<std::uint64_t> ticks = ticks_of(options.seconds, loaded->world.settings.time_step);
  if (!ticks.ok()) return ticks.status();
  RunReport report;
  report.mode = "plain";
  report.describe(*loaded, options, *ticks);
  report.threads = 1;
  report.engine = "f32";
  absl::StatusOr<std::unique_ptr<PlainWorld>> plain = PlainWorld::create(loaded->world);
  if (!plain.ok()) return plain.status();
  const absl::StatusOr<std::vector<BodyRecord>> start = records_of(loaded->world);
  if (!start.ok()) return start.status();
  Towers towers(loaded->world, *start);
  report.load_seconds = seconds_since(load_start);

  if (absl::Status status = step_all(
          "plain Bullet", [&] { (*plain)->step(); }, report);
      !status.ok())
    return status;

  WorldHash hash;
  (*plain)->for_each_body([&](const BodyRecord& record) {
    towers.set_end(record);
    hash.add(record, loaded->world.anchor);
  });
  report.world_hash = hash.to_string();
  if (!towers.empty()) report.towers = towers.report();
  report.peak_rss_mb = peak_rss_mb(getpid());
  report.peak_rss_mb_by_process = {{"tessera", report.peak_rss_mb}};
  return report;
}

}  // namespace tessera::cli
