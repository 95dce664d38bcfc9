#include "experiments/paper/instances.h"

#include <absl/strings/str_cat.h>

#include <memory>

#include "cli/measure/stopwatch.h"
#include "experiments/heap.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

constexpr int kBodies = 128;
constexpr double kSectorSize = 128;  // m
constexpr double kApart = 4;         // m, between neighbours in a sector
constexpr int kPerRow = 16;

// Sectors in a row along x, each with its share of the balls around its centre.
WorldDescription balls_in_sectors(const WorldSettings& settings, int sectors) {
  WorldBuilder builder(settings);
  builder.add("floor", builder.shape(Plane{}), 1, Eigen::Vector3d::Zero(), Motion::kStatic);
  const ShapeId ball = builder.shape(Sphere{0.5});
  const int per_sector = kBodies / sectors;
  for (int i = 0; i < kBodies; ++i) {
    const int n = i % per_sector;
    const Eigen::Vector3d place(kSectorSize * (i / per_sector) + kApart * (n % kPerRow - kPerRow / 2),
                                kApart * (n / kPerRow - kBodies / kPerRow / 2), 0.5);
    builder.add(absl::StrCat("ball", i), ball, 1, place).linear_velocity.x() = 0.3;
  }
  return builder.world();
}

struct Contestant {
  int sectors = 0;
  std::unique_ptr<Simulation> simulation;
  std::vector<double> step_us;
  double heap_kb = 0;
};

}  // namespace

absl::StatusOr<Report> measure_instances(const ExperimentOptions& options, const Progress& progress) {
  const Tick ticks = options.quick ? 60 : 600;
  constexpr Tick kTicksForMemory = 10;
  WorldSettings settings;
  settings.precision = options.precision;
  settings.sector_size = kSectorSize;
  settings.sleep_after = 0;

  std::vector<Contestant> contestants;
  for (int sectors = 1; sectors <= kBodies; sectors *= 2) {
    Contestant contestant;
    contestant.sectors = sectors;
    const WorldDescription world = balls_in_sectors(settings, sectors);
    const std::size_t before = heap_bytes();
    absl::StatusOr<std::unique_ptr<Simulation>> simulation = Simulation::create(world);
    if (!simulation.ok()) return simulation.status();
    contestant.simulation = *std::move(simulation);
    for (Tick tick = 0; tick < kTicksForMemory; ++tick) contestant.simulation->step();
    contestant.heap_kb = static_cast<double>(heap_bytes() - before) / 1000;
    contestants.push_back(std::move(contestant));
  }
  ProgressCount count(progress, ticks);
  for (Tick tick = 0; tick < ticks; ++tick) {
    for (Contestant& contestant : contestants) {
      const Stopwatch watch;
      contestant.simulation->step();
      contestant.step_us.push_back(watch.microseconds());
    }
    if (absl::Status status = count.advance(); !status.ok()) return status;
  }

  Report report;
  const double one_us = median(contestants.front().step_us);
  for (const Contestant& contestant : contestants) {
    const double step_us = median(contestant.step_us);
    report.table("rows").push_back({{"engine", name_of(options.precision)},
                                    {"sectors", contestant.sectors},
                                    {"bodies", kBodies},
                                    {"ticks", ticks},
                                    {"step_us", step_us},
                                    {"ratio", step_us / one_us},
                                    {"kb_per_sector", contestant.heap_kb / contestant.sectors},
                                    {"hash", contestant.simulation->hash().to_string()}});
  }
  return report;
}

}  // namespace tessera
