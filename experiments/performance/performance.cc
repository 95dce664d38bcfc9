#include "experiments/performance/performance.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "experiments/contestant.h"
#include "experiments/performance/scenes.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera {
namespace {

constexpr double kSector = 16;      // m
constexpr double kOneSector = 512;  // m: all of a scene is in it

struct Race {
  std::string name;
  std::function<WorldDescription(const WorldSettings&)> make;
  bool sleeps = false;
  Tick ticks = 0;
};

std::vector<Race> races(bool quick) {
  const int share = quick ? 16 : 1;
  const auto boxes = [share](const WorldSettings& s) { return dropped_boxes(s, 8192 / share); };
  const auto stacks = [share](const WorldSettings& s) { return towers_of_ten(s, 800 / share); };
  const auto rows = [quick](const WorldSettings& s) { return pyramid_world(s, quick ? 10 : 30); };
  const auto mixed = [quick](const WorldSettings& s) { return mixed_bodies(s, quick ? 140 : 2800); };
  const Tick ticks = quick ? 60 : 200;
  const Tick ten_seconds = quick ? 120 : 600;
  return {{"pile", boxes, false, ticks},
          {"pile_to_rest", boxes, true, ten_seconds},
          {"towers", stacks, false, ticks},
          {"pyramid", rows, false, ten_seconds},
          {"mixed", mixed, false, ticks}};
}

// A world that is stepped in turn with the others of its race.
struct Runner {
  std::string name;
  Contestant world;
  Positions start;
};

absl::StatusOr<std::vector<Runner>> runners_of(const Race& race, Precision precision) {
  std::vector<Runner> runners;
  const auto add = [&](const std::string& name, double sector_size, bool is_plain) {
    WorldSettings settings;
    settings.precision = precision;
    settings.sector_size = sector_size;
    if (!race.sleeps) settings.sleep_after = 0;
    const WorldDescription world = race.make(settings);
    absl::StatusOr<std::unique_ptr<LocalWorld>> made = is_plain ? in_one_world(world) : in_sectors(world);
    if (!made.ok()) return made.status();
    runners.push_back({name, Contestant(*std::move(made), world), {}});
    runners.back().start = runners.back().world.positions();
    return absl::OkStatus();
  };
  if (absl::Status status = add("sectors of 16 m", kSector, false); !status.ok()) return status;
  if (absl::Status status = add("one sector", kOneSector, false); !status.ok()) return status;
  if (absl::Status status = add("plain Bullet", kOneSector, true); !status.ok()) return status;
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
  ProgressCount count(progress, total);
  Report report;
  for (const Race& race : all) {
    absl::StatusOr<std::vector<Runner>> runners = runners_of(race, options.precision);
    if (!runners.ok()) return runners.status();
    for (Tick tick = 0; tick < race.ticks; ++tick) {
      for (Runner& runner : *runners) runner.world.step();
      if (absl::Status status = count.advance(); !status.ok()) return status;
    }
    const double plain_us = runners->back().world.spent_us(race.ticks);
    for (const Runner& runner : *runners) {
      const Positions places = runner.world.positions();
      const double spent_us = runner.world.spent_us(race.ticks);
      report.table("rows").push_back({{"engine", name_of(options.precision)},
                                      {"scene", race.name},
                                      {"world", runner.name},
                                      {"bodies", places.size()},
                                      {"ticks", race.ticks},
                                      {"tick_us", spent_us / static_cast<double>(race.ticks)},
                                      {"drift_m", horizontal_drift(runner.start, places)},
                                      {"hash", runner.world.hash()},
                                      {"ratio", spent_us / plain_us}});
    }
  }
  return report;
}

}  // namespace tessera
