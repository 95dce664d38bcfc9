#include "experiments/paper/instances.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <memory>

#include "experiments/contestant.h"
#include "experiments/heap.h"
#include "experiments/turns.h"
#include "lpss/simulation/example_worlds.h"

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
    const int sector = i / per_sector;
    const int n = i % per_sector;
    const int column = n % kPerRow - kPerRow / 2;
    const int row = n / kPerRow - kBodies / kPerRow / 2;
    const Eigen::Vector3d place(kSectorSize * sector + kApart * column, kApart * row, 0.5);
    builder.add(absl::StrCat("ball", i), ball, 1, place).linear_velocity.x() = 0.3;
  }
  return builder.world();
}

struct Balls {
  int sectors = 0;
  double heap_kb = 0;
  Contestant world;
};

}  // namespace

absl::StatusOr<Report> measure_instances(const ExperimentOptions& options, const Progress& progress) {
  const Tick ticks = options.quick ? 60 : 600;
  constexpr Tick kTicksForMemory = 10;
  WorldSettings settings;
  settings.precision = options.precision;
  settings.sector_size = kSectorSize;
  settings.sleep_after = 0;

  std::vector<Balls> all;
  for (int sectors = 1; sectors <= kBodies; sectors *= 2) {
    const WorldDescription world = balls_in_sectors(settings, sectors);
    const std::size_t before = heap_bytes();
    absl::StatusOr<std::unique_ptr<LocalWorld>> local = in_sectors(world);
    if (!local.ok()) return local.status();
    (*local)->run(kTicksForMemory);
    const double heap_kb = static_cast<double>(heap_bytes() - before) / 1000;
    all.push_back({sectors, heap_kb, Contestant(*std::move(local), world)});
  }
  ProgressCount count(progress, ticks);
  absl::Status status = in_turns(all, ticks, kTicksInTurn, count, [](Balls& balls) { balls.world.step(); });
  if (!status.ok()) return status;

  Report report;
  const double one_us = median(all.front().world.ticks_us());
  for (const Balls& balls : all) {
    const double step_us = median(balls.world.ticks_us());
    report.table("rows").push_back({{"engine", name_of(options.precision)},
                                    {"sectors", balls.sectors},
                                    {"bodies", kBodies},
                                    {"ticks", ticks},
                                    {"step_us", step_us},
                                    {"ratio", step_us / one_us},
                                    {"kb_per_sector", balls.heap_kb / balls.sectors},
                                    {"hash", balls.world.hash()}});
  }
  return report;
}

}  // namespace tessera
