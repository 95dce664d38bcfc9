#include "experiments/programs/programs.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "cli/measure/stopwatch.h"
#include "experiments/programs/people.h"
#include "lpss/simulation/example_programs.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

constexpr int kCars = 60;
constexpr int kLifts = 200;

WorldDescription cars(Precision precision) {
  WorldBuilder builder = plane(precision);
  for (int n = 0; n < kCars; ++n)
    add_car(builder, absl::StrCat("car", n), place_in_square(n, kCars, 12, 0.6),
            {{"throttle", 0.1}, {"speed", 4}, {"steer", 0.8}});
  return builder.world();
}

WorldDescription lifts(Precision precision) {
  WorldBuilder builder = plane(precision);
  const ShapeId box = builder.shape(Box{{2, 2, 0.2}});
  for (int n = 0; n < kLifts; ++n) {
    builder.add(absl::StrCat("lift", n), box, 1, place_in_square(n, kLifts, 4, 0.5), Motion::kKinematic)
        .programs.push_back(example_program("mover", {{"z", 5}, {"repeat", 1}, {"wait", 0}}));
  }
  return builder.world();
}

struct ProgramScene {
  const char* name;
  std::function<WorldDescription(Precision)> world;
};

// Of this process: others on the machine do not count.
std::chrono::nanoseconds now() { return processor_time(); }

absl::StatusOr<Row> row_of(const ProgramScene& scene, const ExperimentOptions& options,
                           ProgressCount& count) {
  const Tick ticks = options.quick ? 60 : 600;
  const absl::StatusOr<std::unique_ptr<Simulation>> simulation =
      Simulation::create(scene.world(options.precision), 1, now);
  if (!simulation.ok()) return simulation.status();
  std::vector<double> tick_us;
  std::vector<double> programs_us;
  std::uint64_t instances = 0;
  for (Tick tick = 0; tick < ticks; ++tick) {
    (*simulation)->step();
    const auto us = [](std::chrono::nanoseconds time) { return static_cast<double>(time.count()) / 1e3; };
    const PhaseTimes& times = (*simulation)->phase_times();
    tick_us.push_back(us(std::accumulate(times.begin(), times.end(), std::chrono::nanoseconds{})));
    programs_us.push_back(us(times[static_cast<std::size_t>(TickPhase::kPrograms)]));
    instances = std::max(instances, (*simulation)->counts().programs);
    if (absl::Status status = count.advance(); !status.ok()) return status;
  }
  const double programs = median(programs_us);
  return Row{{"engine", name_of(options.precision)},
             {"scene", scene.name},
             {"instances", instances},
             {"ticks", ticks},
             {"tick_us", median(tick_us)},
             {"programs_us", programs},
             {"us_per_instance", programs / static_cast<double>(std::max<std::uint64_t>(instances, 1))},
             {"hash", (*simulation)->hash().to_string()},
             {"program_hash", (*simulation)->program_hash().to_string()}};
}

}  // namespace

absl::StatusOr<Report> measure_programs(const ExperimentOptions& options, const Progress& progress) {
  const std::vector<ProgramScene> scenes = {
      {"500 characters that walk",
       [](Precision p) {
         return people_on_plane(p, {{"x", 1}});
       }},
      {"500 characters that wander", [](Precision p) { return wanderers_on_plane(p); }},
      {"60 cars", cars},
      {"200 lifts", lifts},
  };
  Report report;
  ProgressCount count(progress, (options.quick ? 60 : 600) * scenes.size(), report);
  for (const ProgramScene& scene : scenes) {
    absl::StatusOr<Row> row = row_of(scene, options, count);
    if (!row.ok()) return row.status();
    report.table("rows").push_back(*std::move(row));
  }
  return report;
}

}  // namespace tessera
