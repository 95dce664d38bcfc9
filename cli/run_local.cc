#include "cli/run_local.h"

#include <absl/functional/function_ref.h>
#include <unistd.h>

#include <algorithm>
#include <functional>

#include "cli/interrupt.h"
#include "cli/prepared_run.h"
#include "cli/terminal.h"
#include "lpss/observe/state.h"
#include "lpss/simulation/plain_world.h"
#include "lpss/simulation/simulation.h"
#include "lpss/snapshot/world_catalogue.h"
#include "proto/snapshot_file.h"

namespace tessera::cli {
namespace {

// Steps, measures each tick, and leaves the times in the report. `look` is called between ticks, from the
// first one on, with their number.
absl::Status step_all(const std::string& what, const std::function<void()>& step,
                      const std::function<void(Tick)>& look, RunReport& report) {
  std::vector<double> milliseconds;
  milliseconds.reserve(std::min<std::uint64_t>(report.ticks, 10'000'000));
  ProgressBar progress(what, report.ticks);
  const Clock::time_point start = Clock::now();
  look(report.first_tick);
  for (std::uint64_t tick = 0; tick < report.ticks; ++tick) {
    if (interrupted()) return absl::CancelledError("interrupted");
    const Clock::time_point tick_start = Clock::now();
    step();
    milliseconds.push_back(seconds_since(tick_start) * 1e3);
    look(report.first_tick + tick + 1);
    progress.update(tick + 1);
  }
  report.set_wall_time(seconds_since(start));
  report.tick_ms = tick_times(std::move(milliseconds));
  return absl::OkStatus();
}

// What became of the bodies that `for_each_body` visits.
absl::StatusOr<RunReport> finished(
    RunReport report, const WorldDescription& world, const WorldHash& hash,
    absl::FunctionRef<void(const std::function<void(const BodyRecord&)>&)> for_each_body) {
  report.world_hash = hash.to_string();
  report.peak_rss_mb = peak_rss_mb(getpid());
  report.peak_rss_mb_by_process = {{"tessera", report.peak_rss_mb}};
  absl::StatusOr<std::vector<BodyRecord>> start = records_of(world);
  if (!start.ok()) return start.status();
  Towers towers(world, *start);
  Movement movement(*std::move(start), world.settings.sector_size, report.settings.precision);
  for_each_body([&](const BodyRecord& record) {
    towers.set_end(record);
    movement.set_end(record);
  });
  if (!towers.empty()) report.towers = towers.report();
  report.movement = movement.report();
  return report;
}

std::string name_of(BodyId id, const WorldCatalogue& catalogue) {
  const auto found = std::ranges::lower_bound(catalogue.bodies, id, {}, &WorldCatalogue::Body::id);
  return found != catalogue.bodies.end() && found->id == id ? found->name : "";
}

std::string name_of(JointId id, const WorldCatalogue& catalogue) {
  const auto found =
      std::ranges::lower_bound(catalogue.joints, id, {}, [](const auto& joint) { return joint.record.id; });
  return found != catalogue.joints.end() && found->record.id == id ? found->name : "";
}

// The rows of a tick, where it is wanted.
void add_rows(const Simulation& simulation, Trajectory& trajectory, Tick tick) {
  if (!trajectory.wants(tick)) return;
  for (const BodyId id : trajectory.ids()) {
    if (const std::optional<BodyRecord> body = body_of(simulation.partition(), id)) {
      trajectory.add(tick, *body);
    } else if (const BodyRecord* fixed = simulation.partition().statics.find(id)) {
      trajectory.add(tick, *fixed);
    }
  }
}

void note_divergences(const std::vector<Divergence>& divergences, const WorldCatalogue& catalogue,
                      RunReport& report) {
  for (const Divergence& divergence : divergences) {
    if (report.divergences.size() == kDivergencesKept) return;
    NamedDivergence& named = report.divergences.emplace_back(NamedDivergence{divergence, "", ""});
    named.body_name = name_of(divergence.body, catalogue);
    named.joint_name = name_of(divergence.joint, catalogue);
  }
}

}  // namespace

absl::StatusOr<RunReport> run_in_process(const RunOptions& options) {
  absl::StatusOr<PreparedRun> run = prepare(options, "in-process");
  if (!run.ok()) return run.status();
  RunReport& report = run->report;
  const WorldDescription& world = run->loaded.world;
  const absl::StatusOr<std::unique_ptr<Simulation>> simulation =
      run->snapshot ? Simulation::restore(run->snapshot->world, report.threads)
                    : Simulation::create(world, report.threads);
  if (!simulation.ok()) return simulation.status();
  report.load_seconds = seconds_since(run->begin);
  const WorldCatalogue catalogue = run->snapshot ? run->snapshot->catalogue : catalogue_of(world);

  const auto step = [&] {
    (*simulation)->step();
    const TickCounts& counts = (*simulation)->counts();
    report.sectors = counts.sectors;
    report.counts.add_tick(counts);
    note_divergences((*simulation)->divergences(), catalogue, report);
  };
  const auto look = [&](Tick tick) {
    if (run->trajectory) add_rows(**simulation, *run->trajectory, tick);
  };
  if (absl::Status status = step_all("in-process", step, look, report); !status.ok()) return status;
  if (run->trajectory) {
    if (absl::Status status = run->trajectory->finish(); !status.ok()) return status;
  }

  if (!options.snapshot.empty()) {
    absl::Status status = write_snapshot(options.snapshot, chunks_of((*simulation)->snapshot(), catalogue));
    if (!status.ok()) return status;
  }
  if (const WorldHash programs = (*simulation)->program_hash(); programs != WorldHash())
    report.program_hash = programs.to_string();
  return finished(std::move(report), world, (*simulation)->hash(),
                  [&](const auto& visit) { (*simulation)->for_each_body(visit); });
}

absl::StatusOr<RunReport> run_plain(const RunOptions& options) {
  absl::StatusOr<PreparedRun> run = prepare(options, "plain");
  if (!run.ok()) return run.status();
  RunReport& report = run->report;
  const WorldDescription& world = run->loaded.world;
  report.threads = 1;
  report.settings.precision = Precision::kFloat32;
  const absl::StatusOr<std::unique_ptr<PlainWorld>> plain = PlainWorld::create(world, Precision::kFloat32);
  if (!plain.ok()) return plain.status();
  report.load_seconds = seconds_since(run->begin);

  const auto step = [&] { (*plain)->step(); };
  const auto look = [&](Tick tick) {
    if (!run->trajectory || !run->trajectory->wants(tick)) return;
    (*plain)->for_each_body([&](const BodyRecord& body) { run->trajectory->add(tick, body); });
  };
  if (absl::Status status = step_all("plain Bullet", step, look, report); !status.ok()) return status;
  if (run->trajectory) {
    if (absl::Status status = run->trajectory->finish(); !status.ok()) return status;
  }

  return finished(std::move(report), world, (*plain)->hash(),
                  [&](const auto& visit) { (*plain)->for_each_body(visit); });
}

}  // namespace tessera::cli
