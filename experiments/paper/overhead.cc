#include "experiments/paper/overhead.h"

#include <absl/strings/str_cat.h>

#include <array>
#include <chrono>
#include <functional>
#include <memory>
#include <vector>

#include "cli/measure/local_world.h"
#include "cli/measure/stopwatch.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

constexpr double kTowerSector = 16;  // m
constexpr int kHeight = 8;           // boxes of 1 m
constexpr double kTowersApart = 2;   // m, from tower to tower
constexpr double kFloor = -4;        // m, height of its top: towers stand in one layer of sectors
constexpr Tick kUnmeasured = 5;      // the first ticks find all contacts anew

struct Variant {
  SeamPolicy seams;
  int substeps;
};
const Variant kVariants[] = {
    {SeamPolicy::kIsland, 1}, {SeamPolicy::kClone, 1}, {SeamPolicy::kIsland, WorldSettings().substeps}};

// Towers in one square, or two side by side, around the edge where four sectors meet.
WorldDescription towers(const WorldSettings& settings, int count) {
  int columns = 1;
  while (columns * columns < count) columns *= 2;
  const int rows = count / columns;
  const double corner = settings.sector_size / 2;
  WorldBuilder builder(settings);
  builder.add_floor(corner + kTowersApart * columns, kFloor);
  const ShapeId box = builder.shape(Box{{1, 1, 1}});
  for (int tower = 0; tower < count; ++tower) {
    const int column = tower % columns - columns / 2;
    const int row = tower / columns - rows / 2;
    const double x = corner + kTowersApart * column;
    const double y = corner + kTowersApart * row;
    for (int level = 0; level < kHeight; ++level) {
      // Slightly offset, so that a border has boxes on either side.
      const Eigen::Vector3d place(x + 0.02 * ((level * 7 + tower) % 5 - 2),
                                  y + 0.02 * ((level * 3 + tower) % 5 - 2), kFloor + level + 0.5);
      builder.add(absl::StrCat("box", tower * kHeight + level), box, 1, place);
    }
  }
  return builder.world();
}

// The bodies with one variant of solving, and the time of each tick.
class Timed {
 public:
  Timed(const Variant& variant, std::unique_ptr<Simulation> simulation)
      : variant_(variant), simulation_(std::move(simulation)) {}

  void step(bool measured) {
    const double tick_us = processor_us([&] { simulation_->step(); });
    const double hashing_us = processor_us([&] { hash_ = simulation_->hash(); });
    if (!measured) return;
    tick_us_.push_back(tick_us);
    hashing_us_.push_back(hashing_us);
    const PhaseTimes& times = simulation_->phase_times();
    for (std::size_t phase = 0; phase < kTickPhases; ++phase) {
      phase_us_[phase].push_back(microseconds(times[phase]));
    }
  }

  void report(Precision precision, int bodies, double plain_us, Report& report) const {
    const Row start = {{"engine", name_of(precision)},
                       {"seams", name_of(variant_.seams)},
                       {"substeps", variant_.substeps},
                       {"bodies", bodies}};
    const double tick_us = median(tick_us_);
    const auto add = [&](const char* phase, const std::vector<double>& phase_us) {
      Row row = start;
      row["phase"] = phase;
      row["us"] = median(phase_us);
      row["share"] = median(phase_us) / tick_us;
      report.table("rows").push_back(std::move(row));
    };
    for (std::size_t phase = 0; phase < kTickPhases; ++phase) {
      add(name_of(static_cast<TickPhase>(phase)), phase_us_[phase]);
    }
    add("hashing", hashing_us_);
    const TickCounts& counts = simulation_->counts();
    Row row = start;
    row["sectors"] = counts.sectors;
    row["clones"] = counts.clones;
    row["contacts"] = counts.contacts;
    row["islands_across_seams"] = counts.islands_across_seams;
    row["ticks"] = tick_us_.size();
    row["tick_us"] = tick_us;
    row["plain_us"] = plain_us;
    row["ratio"] = tick_us / plain_us;
    row["hash"] = hash_.to_string();
    report.table("ticks").push_back(std::move(row));
  }

 private:
  Variant variant_;
  std::unique_ptr<Simulation> simulation_;
  WorldHash hash_;
  std::vector<double> tick_us_;
  std::vector<double> hashing_us_;
  std::array<std::vector<double>, kTickPhases> phase_us_;
};

absl::Status measure(Precision precision, int bodies, Tick ticks, ProgressCount& count, Report& report) {
  WorldSettings settings;
  settings.precision = precision;
  settings.sector_size = kTowerSector;
  settings.sleep_after = 0;
  WorldDescription world = towers(settings, bodies / kHeight);
  absl::StatusOr<std::unique_ptr<LocalWorld>> one_world = in_one_world(world);
  if (!one_world.ok()) return one_world.status();
  std::vector<double> plain_us;
  std::vector<Timed> contestants;
  for (const Variant& variant : kVariants) {
    world.settings.seams = variant.seams;
    world.settings.substeps = variant.substeps;
    absl::StatusOr<std::unique_ptr<Simulation>> simulation =
        Simulation::create(world, /*threads=*/1, processor_time);
    if (!simulation.ok()) return simulation.status();
    contestants.emplace_back(variant, *std::move(simulation));
  }
  for (Tick tick = 0; tick < kUnmeasured + ticks; ++tick) {
    const bool measured = tick >= kUnmeasured;
    for (Timed& contestant : contestants) contestant.step(measured);
    const double step_us = processor_us([&] { (*one_world)->step(); });
    if (!measured) continue;
    plain_us.push_back(step_us);
    if (absl::Status status = count.advance(); !status.ok()) return status;
  }
  for (const Timed& contestant : contestants) {
    contestant.report(precision, bodies, median(plain_us), report);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<Report> measure_overhead_of(Precision precision, std::span<const int> bodies, Tick ticks,
                                           const Progress& progress) {
  Report report;
  ProgressCount count(progress, bodies.size() * ticks, report);
  for (const int n : bodies) {
    if (absl::Status status = measure(precision, n, ticks, count, report); !status.ok()) return status;
  }
  return report;
}

absl::StatusOr<Report> measure_overhead(const ExperimentOptions& options, const Progress& progress) {
  constexpr int kFewest = 128;
  const int most = options.quick ? 4096 : 32768;
  std::vector<int> bodies;
  for (int n = kFewest; n <= most; n *= 2) bodies.push_back(n);
  return measure_overhead_of(options.precision, bodies, options.quick ? 20 : 30, progress);
}

}  // namespace tessera
