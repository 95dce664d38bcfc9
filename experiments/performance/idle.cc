#include "experiments/performance/idle.h"

#include <absl/strings/str_cat.h>

#include <memory>
#include <vector>

#include "cli/measure/stopwatch.h"
#include "experiments/heap.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

constexpr int kAwake = 1000;
constexpr int kBallsInRow = 32;
constexpr double kBallsApart = 3.5;  // m, between the balls
constexpr int kSectorsInRow = 1000;  // beside the balls' own
constexpr Tick kTicksToRest = 2000;  // until sectors are packed, at most

WorldDescription balls_beside_sleepers(const WorldSettings& settings, int idle_sectors) {
  WorldBuilder builder(settings);
  builder.add("ground", builder.shape(Plane{}), 1, Eigen::Vector3d::Zero(), Motion::kStatic);
  const ShapeId ball = builder.shape(Sphere{0.5});
  for (int i = 0; i < kAwake; ++i) {
    const int column = i % kBallsInRow - kBallsInRow / 2;
    const int row = i / kBallsInRow - kBallsInRow / 2;
    const Eigen::Vector3d place(kBallsApart * column, kBallsApart * row, 0.5);
    builder.add(absl::StrCat("ball", i), ball, 1, place).linear_velocity.x() = 0.1;
  }
  const ShapeId box = builder.shape(Box{{1, 1, 1}});
  for (int i = 0; i < idle_sectors; ++i) {
    const int column = 2 + i % kSectorsInRow;
    const int row = i / kSectorsInRow;
    const Eigen::Vector3d sector(column, row, 0);
    const Eigen::Vector3d place = sector * settings.sector_size + Eigen::Vector3d(7, 9, 0.5);
    builder.add(absl::StrCat("box", i), box, 1, place);
  }
  return builder.world();
}

struct World {
  int idle_sectors = 0;
  double heap_bytes = 0;
  std::unique_ptr<Simulation> simulation;
  std::vector<double> ticks_us;
};

absl::StatusOr<World> world_with(const WorldSettings& settings, int idle_sectors) {
  World world;
  world.idle_sectors = idle_sectors;
  const std::size_t before = heap_bytes();
  absl::StatusOr<std::unique_ptr<Simulation>> simulation =
      Simulation::create(balls_beside_sleepers(settings, idle_sectors));
  if (!simulation.ok()) return simulation.status();
  world.simulation = *std::move(simulation);
  const PackedSectors& packed = world.simulation->partition().packed;
  const auto sleepers = static_cast<std::size_t>(idle_sectors);
  while (packed.counts().bodies < sleepers && world.simulation->tick() < kTicksToRest) world.simulation->step();
  world.heap_bytes = static_cast<double>(heap_bytes() - before);
  return world;
}

}  // namespace

absl::StatusOr<Report> measure_idle(const ExperimentOptions& options, const Progress& progress) {
  const Tick ticks = options.quick ? 200 : 500;
  WorldSettings settings;
  settings.precision = options.precision;
  settings.sleep_after = 0.1;
  std::vector<World> worlds;
  for (const int idle_sectors : {0, options.quick ? 100'000 : 1'000'000}) {
    absl::StatusOr<World> world = world_with(settings, idle_sectors);
    if (!world.ok()) return world.status();
    worlds.push_back(*std::move(world));
  }
  ProgressCount count(progress, ticks);
  for (Tick tick = 0; tick < ticks; ++tick) {
    for (World& world : worlds) {
      const auto before = processor_time();
      world.simulation->step();
      world.ticks_us.push_back(microseconds(processor_time() - before));
    }
    if (absl::Status status = count.advance(); !status.ok()) return status;
  }

  Report report;
  const double alone_us = median(worlds.front().ticks_us);
  for (const World& world : worlds) {
    const double step_us = median(world.ticks_us);
    Row row = {{"engine", name_of(options.precision)},
               {"idle_sectors", world.idle_sectors},
               {"awake_bodies", kAwake},
               {"ticks", ticks},
               {"step_us", step_us},
               {"ratio", step_us / alone_us}};
    row["bytes_per_sector"] = world.idle_sectors > 0
                                  ? Row((world.heap_bytes - worlds.front().heap_bytes) / world.idle_sectors)
                                  : Row();
    row["hash"] = world.simulation->hash().to_string();
    report.table("rows").push_back(std::move(row));
  }
  return report;
}

}  // namespace tessera
