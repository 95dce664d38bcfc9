#include "experiments/extremes/row.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "cli/measure/own_process.h"
#include "cli/measure/positions.h"
#include "cli/measure/stopwatch.h"
#include "experiments/heap.h"
#include "lpss/simulation/simulation.h"

namespace tessera::extremes {
namespace {

// Of processor time, independent of other load; several times what the slowest scenes need.
constexpr std::chrono::seconds kSecondsMax{60};

constexpr double kLost = std::numeric_limits<double>::quiet_NaN();

struct Outcome {
  std::string what;
  double figure = kLost;
  Tick ticks = 0;
};

Moment moment_of(const Simulation& simulation, const WorldDescription& world, std::uint64_t stopped) {
  Moment moment;
  moment.settings = world.settings;
  moment.tick = simulation.tick();
  moment.time = static_cast<double>(moment.tick) * world.settings.time_step;
  simulation.for_each_body([&](const BodyRecord& record) { moment.bodies.push_back(record); });
  moment.positions =
      positions_from({world.anchor, Eigen::Vector3d::Zero()}, moment.bodies, world.settings.sector_size);
  moment.stopped = stopped;
  moment.heap_bytes = heap_bytes();
  return moment;
}

double bound_of(const Scene& scene, Precision precision) {
  return scene.asks.bound + (scene.rounding ? scene.rounding(precision) : 0);
}

// A running scene.
class Run {
 public:
  Run(const Scene& scene, const WorldDescription& world, Simulation& simulation)
      : scene_(scene), world_(world), simulation_(simulation) {}

  Outcome outcome(Tick ticks) {
    while (simulation_.tick() < scene_.lasts.warm_up) step();
    const Moment start = moment_of(simulation_, world_, stopped_);
    const Tick end = scene_.lasts.warm_up + ticks;
    double largest = std::numeric_limits<double>::lowest();
    while (simulation_.tick() < end && std::isfinite(largest)) {
      step();
      const bool is_sample =
          scene_.lasts.sample_every > 0 && simulation_.tick() % scene_.lasts.sample_every == 0;
      if (!is_sample && simulation_.tick() < end) continue;
      const double figure = scene_.asks.figure(start, moment_of(simulation_, world_, stopped_));
      largest = std::isfinite(figure) ? std::max(largest, figure) : kLost;
    }
    return {account(largest), largest, simulation_.tick()};
  }

 private:
  void step() {
    simulation_.step(simulation_.tick() == 0 ? std::span(scene_.commands) : std::span<const Command>());
    stopped_ += simulation_.counts().diverged;
  }

  std::string account(double figure) const {
    if (!std::isfinite(figure))
      return absl::StrCat("The measured figure is not a number at tick ", simulation_.tick(), ".");
    const bool holds = figure <= bound_of(scene_, world_.settings.precision);
    std::string account = holds ? scene_.asks.holds : scene_.asks.fails;
    if (holds && figure > scene_.asks.bound) absl::StrAppend(&account, " ", scene_.rounding_reason);
    if (stopped_ > 0) absl::StrAppend(&account, " (Bodies out of range were stopped: ", stopped_, " times.)");
    return account;
  }

  const Scene& scene_;
  const WorldDescription& world_;
  Simulation& simulation_;
  std::uint64_t stopped_ = 0;
};

Outcome outcome_of(const Scene& scene, const ExperimentOptions& options) {
  WorldSettings settings;
  settings.precision = options.precision;
  const WorldDescription world = scene.world(settings);
  const absl::StatusOr<std::unique_ptr<Simulation>> simulation = Simulation::create(world);
  if (simulation.ok()) {
    return Run(scene, world, **simulation)
        .outcome(options.quick ? scene.lasts.quick_ticks : scene.lasts.ticks);
  }
  const bool refused =
      absl::IsInvalidArgument(simulation.status()) || absl::IsOutOfRange(simulation.status());
  return {absl::StrCat(refused ? "Refused: " : "Failed: ", simulation.status().message()),
          refused && scene.may_be_refused ? 0 : kLost, 0};
}

Report report_of(const Scene& scene, const ExperimentOptions& options, const Outcome& outcome,
                 double wall_s) {
  const char* engine = name_of(options.precision);
  const double bound = bound_of(scene, options.precision);
  const bool within = outcome.figure <= bound;
  Report report;
  Row row = {{"group", scene.group}, {"scene", scene.name}, {"engine", engine}, {"what", outcome.what}};
  row["figure"] = std::isfinite(outcome.figure) ? Row(outcome.figure) : Row();
  row["unit"] = scene.asks.unit;
  row["bound"] = bound;
  row["within"] = within;
  row["ticks"] = outcome.ticks;
  row["wall_s"] = wall_s;
  report.table("rows").push_back(std::move(row));
  if (!within) {
    report.misses.push_back(absl::StrFormat("%s, %s %s: %g %s, bound %g: %s", engine, scene.group, scene.name,
                                            outcome.figure, scene.asks.unit, bound, outcome.what));
  }
  return report;
}

}  // namespace

Report measure(const Scene& scene, const ExperimentOptions& options) {
  const Stopwatch watch;
  const Outcome outcome = outcome_of(scene, options);
  return report_of(scene, options, outcome, watch.microseconds() * 1e-6);
}

absl::StatusOr<Report> measure_apart(const Scene& scene, const ExperimentOptions& options) {
  const Stopwatch watch;
  absl::StatusOr<Report> report =
      in_own_process([&] { return absl::StatusOr<Report>(measure(scene, options)); }, kSecondsMax);
  if (report.ok() || absl::IsCancelled(report.status())) return report;
  const Outcome outcome{absl::StrCat("Crashed, or did not finish in time: ", report.status().message(), "."),
                        kLost, 0};
  return report_of(scene, options, outcome, watch.microseconds() * 1e-6);
}

}  // namespace tessera::extremes
