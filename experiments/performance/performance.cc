#include "experiments/performance/performance.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "experiments/contestant.h"
#include "experiments/performance/scenes.h"
#include "experiments/turns.h"
#include "lpss/observe/mechanics.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera {
namespace {

constexpr const char* kPlain = "plain Bullet";
constexpr double kSector = 16;      // m
constexpr double kOneSector = 512;  // m: all of a scene is in it
constexpr int kFineSteps = 16;      // in the time of a tick

struct Race {
  std::string name;
  std::function<WorldDescription(const WorldSettings&)> make;
  bool sleeps = false;
  Tick ticks = 0;
  bool has_joints = false;
};

std::vector<Race> races(bool quick) {
  const int share = quick ? 16 : 1;
  const auto boxes = [share](const WorldSettings& s) { return dropped_boxes(s, 8192 / share); };
  const auto stacks = [share](const WorldSettings& s) { return towers_of_ten(s, 800 / share); };
  const auto rows = [quick](const WorldSettings& s) { return pyramid_world(s, quick ? 10 : 30); };
  const auto mixed = [quick](const WorldSettings& s) { return mixed_bodies(s, quick ? 140 : 2800); };
  const auto poured = [share](Poured kind, Bottom bottom = Bottom::kFloor) {
    return [=](const WorldSettings& s) { return poured_bodies(s, kind, 4096 / share, bottom); };
  };
  const Tick ticks = quick ? 60 : 200;
  const Tick ten_seconds = quick ? 120 : 600;
  return {{"pile", boxes, false, ticks},
          {"pile_to_rest", boxes, true, ten_seconds},
          {"towers", stacks, false, ticks},
          {"pyramid", rows, false, ten_seconds},
          {"bin_balls", poured(Poured::kBalls), false, ticks},
          {"bin_capsules", poured(Poured::kCapsules), false, ticks},
          {"bin_boxes", poured(Poured::kBoxes), false, ticks},
          {"bin_cylinders", poured(Poured::kCylinders), false, ticks},
          {"bin_all", poured(Poured::kAll), false, ticks},
          {"bin_all_on_hills", poured(Poured::kAll, Bottom::kHills), false, ticks},
          {"bin_all_on_mesh", poured(Poured::kAll, Bottom::kMesh), false, ticks},
          {"bin_boxes_on_mesh", poured(Poured::kBoxes, Bottom::kMesh), false, ticks},
          {"mixed", mixed, false, ticks, true}};
}

// A world that is stepped in turn with the others of its race.
class Runner {
 public:
  static absl::StatusOr<Runner> create(const std::string& name, const Race& race, WorldSettings settings,
                                       bool is_plain, int steps = 1) {
    settings.time_step /= steps;
    if (!race.sleeps) settings.sleep_after = 0;
    const WorldDescription world = race.make(settings);
    absl::StatusOr<std::unique_ptr<LocalWorld>> made = is_plain ? in_one_world(world) : in_sectors(world);
    if (!made.ok()) return made.status();
    Runner runner(name, steps, Contestant(*std::move(made), world));
    if (race.has_joints) {
      absl::StatusOr<MechanicsOfWorld> mechanics = MechanicsOfWorld::create(world);
      if (!mechanics.ok()) return mechanics.status();
      runner.mechanics_ = *std::move(mechanics);
    }
    return runner;
  }

  void tick() {
    for (int step = 0; step < steps_; ++step) world_.step();
    if (mechanics_) gap_ = std::max(gap_, mechanics_->at(world_.bodies()).gap);
  }

  const std::string& name() const { return name_; }
  const Contestant& world() const { return world_; }
  const Positions& start() const { return start_; }
  double spent_us(Tick ticks) const { return world_.spent_us(ticks * static_cast<Tick>(steps_)); }
  bool has_joints() const { return mechanics_.has_value(); }
  double gap() const { return gap_; }  // m, the largest of a joint until now

 private:
  Runner(std::string name, int steps, Contestant world)
      : name_(std::move(name)), steps_(steps), world_(std::move(world)), start_(world_.positions()) {}

  std::string name_;
  int steps_;  // in the time of a tick
  Contestant world_;
  Positions start_;
  std::optional<MechanicsOfWorld> mechanics_;
  double gap_ = 0;
};

absl::StatusOr<std::vector<Runner>> runners_of(const Race& race, Precision precision) {
  WorldSettings sectors;
  sectors.precision = precision;
  sectors.sector_size = kSector;
  WorldSettings one_sector = sectors;
  one_sector.sector_size = kOneSector;
  std::vector<absl::StatusOr<Runner>> made;
  made.push_back(Runner::create("sectors of 16 m", race, sectors, false));
  made.push_back(Runner::create("one sector", race, one_sector, false));
  made.push_back(Runner::create(kPlain, race, one_sector, true));
  if (race.has_joints) {
    made.push_back(Runner::create(absl::StrCat(kPlain, ", ", kFineSteps, " steps a tick"), race, one_sector,
                                  true, kFineSteps));
  }
  std::vector<Runner> runners;
  for (absl::StatusOr<Runner>& runner : made) {
    if (!runner.ok()) return runner.status();
    runners.push_back(*std::move(runner));
  }
  return runners;
}

double horizontal_drift(const Positions& from, const Positions& to) {
  double drift = 0;
  for (std::size_t n = 0; n < to.size(); ++n) drift = std::max(drift, (to[n] - from[n]).head<2>().norm());
  return drift;
}

}  // namespace

absl::StatusOr<Report> measure_performance(const ExperimentOptions& options, const Progress& progress) {
  std::vector<Race> all = races(options.quick);
  std::erase_if(all, [&](const Race& race) { return !absl::StrContains(race.name, options.only); });
  if (all.empty())
    return absl::NotFoundError(absl::StrCat("No scene's name contains \"", options.only, "\"."));
  Tick total = 0;
  for (const Race& race : all) total += race.ticks;
  Report report;
  ProgressCount count(progress, total, report);
  for (const Race& race : all) {
    absl::StatusOr<std::vector<Runner>> runners = runners_of(race, options.precision);
    if (!runners.ok()) return runners.status();
    absl::Status status =
        in_turns(*runners, race.ticks, kTicksInTurn, count, [](Runner& runner) { runner.tick(); });
    if (!status.ok()) return status;
    const auto plain = std::ranges::find(*runners, kPlain, &Runner::name);
    const double plain_us = plain->spent_us(race.ticks);
    for (const Runner& runner : *runners) {
      const Positions places = runner.world().positions();
      const double spent_us = runner.spent_us(race.ticks);
      Row row = {{"engine", name_of(options.precision)},
                 {"scene", race.name},
                 {"world", runner.name()},
                 {"bodies", places.size()},
                 {"ticks", race.ticks},
                 {"tick_us", spent_us / static_cast<double>(race.ticks)},
                 {"drift_m", horizontal_drift(runner.start(), places)},
                 {"gap_mm", nullptr},
                 {"hash", runner.world().hash()},
                 {"ratio", spent_us / plain_us}};
      if (runner.has_joints()) row["gap_mm"] = runner.gap() * 1e3;
      report.table("rows").push_back(std::move(row));
    }
  }
  return report;
}

}  // namespace tessera
