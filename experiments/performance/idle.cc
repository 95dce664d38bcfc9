#include "experiments/performance/idle.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "cli/measure/stopwatch.h"
#include "experiments/heap.h"
#include "experiments/turns.h"
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
  while (packed.counts().bodies < sleepers && world.simulation->tick() < kTicksToRest)
    world.simulation->step();
  world.heap_bytes = static_cast<double>(heap_bytes() - before);
  return world;
}

// A body for a command.
struct Newcomer {
  ShapeId shape = 0;
  double moment = 0;  // kg m^2, about each axis
  Eigen::Vector3d place;
  double velocity = 0;  // m/s, along x
};

absl::StatusOr<Command> arrival(const Newcomer& newcomer, std::uint64_t id, const WorldSettings& settings) {
  BodyDescription body;
  body.properties.shape = newcomer.shape;
  body.properties.inertia = {newcomer.moment, newcomer.moment, newcomer.moment};
  body.linear_velocity.x() = newcomer.velocity;
  absl::StatusOr<WorldPosition> position = canonical({}, newcomer.place, settings.sector_size);
  if (!position.ok()) return position.status();
  body.pose.position = *position;
  absl::StatusOr<BodyRecord> record = record_of(body, settings);
  if (!record.ok()) return record.status();
  record->id = BodyId{id};
  return SpawnBody{*std::move(record)};
}

class GrownWorld {
 public:
  GrownWorld(const WorldSettings& settings, bool quick)
      : settings_(settings), boxes_(quick ? 100'000 : 10'000'000), balls_(quick ? 1'000 : 10'000) {}

  // `so_far` is what the experiment has found before.
  absl::StatusOr<Row> measure(const Progress& progress, const Report& so_far) {
    const std::size_t before = heap_bytes();
    if (absl::Status status = load(); !status.ok()) return status;
    ProgressCount count(progress, static_cast<std::uint64_t>(boxes_ / kBatch), so_far);
    for (int n = 0; n < boxes_; n += kBatch) {
      if (absl::Status status = spawn(n, std::min(kBatch, boxes_ - n), &GrownWorld::box); !status.ok())
        return status;
      for (Tick tick = 0; tick < kTicksOfBatch; ++tick) simulation_->step();
      heap_max_ = std::max(heap_max_, heap_bytes() - before);
      if (absl::Status status = count.advance(); !status.ok()) return status;
    }
    while (packed() < static_cast<std::size_t>(boxes_)) simulation_->step();
    if (absl::Status status = spawn(0, balls_, &GrownWorld::ball); !status.ok()) return status;
    const double tick_us = usual_tick_us();
    const std::size_t heap = heap_bytes() - before;
    const double wake_us = wake(tick_us);
    const double bodies = boxes_ + balls_;
    constexpr double kMega = 1e6;
    return Row({{"engine", name_of(settings_.precision)},
                {"bodies", boxes_ + balls_},
                {"awake_bodies", balls_},
                {"tick_us", tick_us},
                {"wake_us", wake_us},
                {"heap_mb", static_cast<double>(heap) / kMega},
                {"heap_mb_max", static_cast<double>(heap_max_) / kMega},
                {"bytes_per_body", static_cast<double>(heap) / bodies},
                {"hash", simulation_->hash().to_string()}});
  }

 private:
  static constexpr int kBatch = 20'000;  // bodies that arrive at once
  static constexpr Tick kTicksOfBatch = 30;
  static constexpr int kInSector = 10;
  static constexpr int kWoken = 1'000;

  std::size_t packed() const { return simulation_->partition().packed.counts().bodies; }

  absl::Status load() {
    WorldBuilder builder(settings_);
    builder.add("ground", builder.shape(Plane{}), 1, Eigen::Vector3d::Zero(), Motion::kStatic);
    ball_ = builder.shape(Sphere{0.5});
    box_ = builder.shape(Box{{1, 1, 1}});
    absl::StatusOr<std::unique_ptr<Simulation>> simulation = Simulation::create(builder.world());
    if (!simulation.ok()) return simulation.status();
    simulation_ = *std::move(simulation);
    return absl::OkStatus();
  }

  Newcomer box(int n) const {
    const int column = n / kInSector % kSectorsInRow;
    const int row = n / kInSector / kSectorsInRow;
    const int place = n % kInSector;
    const Eigen::Vector3d corner(2 + column, row, 0);
    const Eigen::Vector3d within(-5 + 2.5 * (place % 5), place < 5 ? -3 : 3, 0.5);
    return {box_, 1.0 / 6, corner * settings_.sector_size + within, 0};
  }
  Newcomer ball(int n) const {
    constexpr int kInRow = 100;
    const int column = n % kInRow;
    const int row = n / kInRow;
    return {ball_, 0.1, Eigen::Vector3d(-20 - kBallsApart * column, kBallsApart * row, 0.5), 0.1};
  }

  absl::Status spawn(int first, int count, Newcomer (GrownWorld::*newcomer)(int) const) {
    std::vector<Command> commands;
    for (int n = first; n < first + count; ++n) {
      absl::StatusOr<Command> command = arrival((this->*newcomer)(n), ++last_id_, settings_);
      if (!command.ok()) return command.status();
      commands.push_back(*std::move(command));
    }
    simulation_->step(commands);
    return absl::OkStatus();
  }

  double tick_of(std::span<const Command> commands) {
    const auto before = processor_time();
    simulation_->step(commands);
    return microseconds(processor_time() - before);
  }

  double usual_tick_us() {
    std::vector<double> ticks;
    for (int n = 0; n < 100; ++n) ticks.push_back(tick_of({}));
    return median(ticks);
  }

  // Of a sector, beyond a usual tick.
  double wake(double tick_us) {
    std::vector<Command> pushes;
    for (int n = 0; n < kWoken; ++n) {
      const auto box = static_cast<std::uint64_t>(n) * (boxes_ / kWoken) + 2;
      pushes.emplace_back(ApplyImpulse{BodyId{kFirstId + box}, {0.1, 0, 0}, {}});
    }
    return (tick_of(pushes) - tick_us) / kWoken;
  }

  static constexpr std::uint64_t kFirstId = 1;  // of the ground

  WorldSettings settings_;
  const int boxes_;
  const int balls_;
  std::unique_ptr<Simulation> simulation_;
  ShapeId ball_ = 0;
  ShapeId box_ = 0;
  std::uint64_t last_id_ = kFirstId;
  std::size_t heap_max_ = 0;
};

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
  absl::Status status = in_turns(worlds, ticks, /*in_turn=*/1, count, [](World& world) {
    const auto before = processor_time();
    world.simulation->step();
    world.ticks_us.push_back(microseconds(processor_time() - before));
  });
  if (!status.ok()) return status;

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
  worlds.clear();
  absl::StatusOr<Row> grown = GrownWorld(settings, options.quick).measure(progress, report);
  if (!grown.ok()) return grown.status();
  report.table("grown").push_back(*std::move(grown));
  return report;
}

}  // namespace tessera
