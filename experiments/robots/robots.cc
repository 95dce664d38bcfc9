#include "experiments/robots/robots.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/measure/local_world.h"
#include "cli/measure/stopwatch.h"
#include "experiments/lowest_point.h"
#include "experiments/mujoco/mujoco.h"
#include "experiments/robots/robot.h"
#include "experiments/turns.h"
#include "lpss/observe/mechanics.h"

namespace tessera {
namespace robots {
namespace {

constexpr char kMujoco[] = "MuJoCo";
constexpr int kFineSteps = 4;
constexpr Tick kTicksBetweenLooks = 5;

struct Sizes {
  int robots = 0;
  Tick ticks = 0;
  int thrown = 0;
  Tick thrown_ticks = 0;
};

struct Crowd {
  Robot robot;
  Sizes sizes;
};

std::vector<Crowd> crowds(bool quick) {
  const int share = quick ? 16 : 1;
  const Sizes sizes{0, quick ? Tick{50} : Tick{180}, quick ? 4 : 16, quick ? Tick{60} : Tick{300}};
  std::vector<Crowd> all = {{ant(), sizes}, {humanoid(), sizes}};
  all[0].sizes.robots = 256 / share;
  all[1].sizes.robots = 64 / share;
  return all;
}

// What simulates robots, and how.
struct Maker {
  std::string name;
  WorldSettings settings;
  std::optional<MujocoOptions> mujoco;
};

std::vector<Maker> makers(Precision precision) {
  WorldSettings settings;
  settings.precision = precision;
  settings.sleep_after = 0;
  settings.sector_size = 16;
  std::vector<Maker> all = {{"sectors of 16 m", settings, {}}};
  WorldSettings coarse = settings;
  coarse.substeps = 1;
  coarse.adapt = false;
  all.push_back({"sectors of 16 m, 1 substep", coarse, {}});
  coarse.solver_iterations = 2;
  all.push_back({"sectors of 16 m, 1 substep of 2 passes", coarse, {}});
  settings.sector_size = 512;
  all.push_back({"one sector", settings, {}});
  if (!has_mujoco()) return all;
  all.push_back({kMujoco, settings, MujocoOptions{1, /*is_elliptic=*/false}});
  all.push_back({absl::StrCat(kMujoco, ", implicit"), settings,
                 MujocoOptions{1, /*is_elliptic=*/false, /*is_implicit=*/true}});
  all.push_back({absl::StrCat(kMujoco, ", ", kFineSteps, " steps a tick"), settings,
                 MujocoOptions{kFineSteps, /*is_elliptic=*/false}});
  return all;
}

using Worlds = std::vector<std::unique_ptr<LocalWorld>>;

// Worlds that are alike; in sectors, one.
absl::StatusOr<Worlds> worlds_of(const Maker& maker, const WorldDescription& world, int count) {
  if (maker.mujoco) return alike_in_mujoco(world, *maker.mujoco, count);
  absl::StatusOr<std::unique_ptr<LocalWorld>> made = in_sectors(world);
  if (!made.ok()) return made.status();
  Worlds worlds;
  worlds.push_back(*std::move(made));
  return worlds;
}

// The largest of many, and their mean.
struct Spread {
  double most = 0;
  double sum = 0;
  std::size_t count = 0;

  void add(double value) {
    most = std::isfinite(value) ? std::max(most, value) : std::numeric_limits<double>::infinity();
    sum += value;
    ++count;
  }
  double mean() const { return sum / static_cast<double>(count); }
};

Row number(double value) { return std::isfinite(value) ? Row(value) : Row(); }

// Worlds of one or more robots, which are stepped in turn with those of others.
class Fleet {
 public:
  static absl::StatusOr<Fleet> create(const Maker& maker, const Crowd& crowd) {
    Fleet fleet(maker.name, crowd.robot, maker.mujoco ? 1 : crowd.sizes.robots, maker.settings.time_step);
    const WorldDescription world = robots_on_plane(maker.settings, crowd.robot, fleet.in_world_);
    absl::StatusOr<MechanicsOfWorld> mechanics = MechanicsOfWorld::create(world);
    if (!mechanics.ok()) return mechanics.status();
    fleet.mechanics_ = *std::move(mechanics);
    fleet.description_ = world;
    absl::StatusOr<Worlds> made = worlds_of(maker, world, crowd.sizes.robots / fleet.in_world_);
    if (!made.ok()) return made.status();
    fleet.worlds_ = *std::move(made);
    return fleet;
  }

  void tick() {
    std::vector<std::vector<Command>> targets;
    const double time = static_cast<double>(ticks_) * time_step_;
    for (std::size_t n = 0; n < worlds_.size(); ++n)
      targets.push_back(servo_targets(robot_, static_cast<int>(n) * in_world_, in_world_, time));
    const std::chrono::nanoseconds start = processor_time();
    for (std::size_t n = 0; n < worlds_.size(); ++n) worlds_[n]->step(targets[n]);
    spent_ += processor_time() - start;
    for (const auto& world : worlds_) diverged_ += world->diverged();
    if (++ticks_ % kTicksBetweenLooks == 0) look();
  }

  const std::string& name() const { return name_; }
  std::size_t diverged() const { return diverged_; }
  double steps_per_s() const {
    constexpr double kMega = 1e6;
    const auto steps = static_cast<double>(worlds_.size() * static_cast<std::size_t>(in_world_) * ticks_);
    return kMega * steps / microseconds(spent_);
  }

  void fill(Row& row) const {
    row["steps_per_s"] = steps_per_s();
    row["ratio"] = Row();
    row["gap_mm_max"] = number(gap_.most * 1e3);
    row["gap_mm_mean"] = number(gap_.mean() * 1e3);
    row["below_mm_max"] = number(below_.most * 1e3);
    row["below_mm_mean"] = number(below_.mean() * 1e3);
    row["height_m"] = number(height_.mean());
  }
  Row hash() const { return worlds_.size() == 1 ? Row(worlds_.front()->hash().to_string()) : Row(); }

 private:
  Fleet(std::string name, Robot robot, int in_world, double time_step)
      : name_(std::move(name)), robot_(std::move(robot)), in_world_(in_world), time_step_(time_step) {}

  void look() {
    for (const auto& world : worlds_) {
      const std::vector<BodyRecord> bodies = world->bodies();
      for (const JointState& joint : mechanics_->at(bodies).joints) gap_.add(joint.gap);
      double lowest = 0;
      for (std::size_t n = 0; n < bodies.size(); ++n) {
        const BodyRecord& body = bodies[n];
        const Eigen::Vector3d place =
            Eigen::Vector3d(body.state.position.data()) +
            metres_between(description_.anchor, body.home, description_.settings.sector_size);
        lowest = std::min(lowest, lowest_point(description_.shapes[body.properties.shape],
                                               {place, quaternion_of(body.state)}));
        const bool is_trunk = n % robot_.links.size() == 0;
        if (is_trunk) height_.add(place.z());
        if (n % robot_.links.size() + 1 < robot_.links.size()) continue;
        below_.add(-std::exchange(lowest, 0));
      }
    }
  }

  std::string name_;
  Robot robot_;
  int in_world_;  // robots
  double time_step_;
  WorldDescription description_;
  std::optional<MechanicsOfWorld> mechanics_;
  Worlds worlds_;
  std::chrono::nanoseconds spent_{};
  Tick ticks_ = 0;
  std::size_t diverged_ = 0;
  Spread gap_;
  Spread below_;
  Spread height_;
};

// Of robots in space: how much of what should stay does not.
struct Drift {
  int lost = 0;  // whose energy is no longer its own; not in the rest
  Spread energy;
  Spread spin;

  absl::Status add(const Maker& maker, const Crowd& crowd, int number) {
    const WorldDescription world = robot_in_space(maker.settings, crowd.robot, number);
    absl::StatusOr<MechanicsOfWorld> mechanics = MechanicsOfWorld::create(world);
    if (!mechanics.ok()) return mechanics.status();
    const absl::StatusOr<Worlds> made = worlds_of(maker, world, 1);
    if (!made.ok()) return made.status();
    LocalWorld& local = *made->front();
    const Mechanics start = mechanics->at(local.bodies());
    Spread energy_changes, spin_changes;
    for (Tick tick = 0; tick < crowd.sizes.thrown_ticks; ++tick) {
      local.step();
      const Mechanics now = mechanics->at(local.bodies());
      energy_changes.add(std::abs(now.kinetic / start.kinetic - 1));
      spin_changes.add((now.angular_momentum - start.angular_momentum).norm() /
                       start.angular_momentum.norm());
    }
    constexpr double kLost = 1;
    if (energy_changes.most > kLost) {
      ++lost;
      return absl::OkStatus();
    }
    energy.add(energy_changes.most);
    spin.add(spin_changes.most);
    return absl::OkStatus();
  }

  void fill(Row& row) const {
    row["thrown"] = lost + static_cast<int>(energy.count);
    row["thrown_lost"] = lost;
    row["energy_error_max"] = number(energy.most);
    row["energy_error_mean"] = number(energy.mean());
    row["spin_error_max"] = number(spin.most);
    row["spin_error_mean"] = number(spin.mean());
  }
};

absl::StatusOr<Report> measure(const Crowd& crowd, Precision precision, ProgressCount& count) {
  const std::vector<Maker> all = makers(precision);
  std::vector<Fleet> fleets;
  for (const Maker& maker : all) {
    absl::StatusOr<Fleet> fleet = Fleet::create(maker, crowd);
    if (!fleet.ok()) return fleet.status();
    fleets.push_back(*std::move(fleet));
  }
  absl::Status status =
      in_turns(fleets, crowd.sizes.ticks, kTicksInTurn, count, [](Fleet& fleet) { fleet.tick(); });
  if (!status.ok()) return status;
  const auto mujoco = std::ranges::find(fleets, kMujoco, &Fleet::name);
  Report report;
  for (std::size_t n = 0; n < all.size(); ++n) {
    const Fleet& fleet = fleets[n];
    Row row = {
        {"engine", name_of(precision)}, {"robot", crowd.robot.name},        {"world", fleet.name()},
        {"robots", crowd.sizes.robots}, {"hinges", hinges_of(crowd.robot)}, {"ticks", crowd.sizes.ticks}};
    fleet.fill(row);
    if (mujoco != fleets.end()) row["ratio"] = fleet.steps_per_s() / mujoco->steps_per_s();
    Drift drift;
    for (int thrown = 0; thrown < crowd.sizes.thrown; ++thrown) {
      status = drift.add(all[n], crowd, thrown);
      if (!status.ok()) return status;
    }
    drift.fill(row);
    row["hash"] = fleet.hash();
    report.table("rows").push_back(std::move(row));
    if (fleet.diverged() > 0)
      report.misses.push_back(absl::StrCat(name_of(precision), ", ", crowd.robot.name, ", ", fleet.name(),
                                           ": ", fleet.diverged(), " bodies diverge"));
  }
  return report;
}

}  // namespace
}  // namespace robots

absl::StatusOr<Report> measure_robots(const ExperimentOptions& options, const Progress& progress) {
  std::vector<robots::Crowd> all = robots::crowds(options.quick);
  std::erase_if(
      all, [&](const robots::Crowd& crowd) { return !absl::StrContains(crowd.robot.name, options.only); });
  if (all.empty())
    return absl::NotFoundError(absl::StrCat("No robot's name contains \"", options.only, "\"."));
  Tick total = 0;
  for (const robots::Crowd& crowd : all) total += crowd.sizes.ticks;
  Report report;
  ProgressCount count(progress, total, report);
  for (const robots::Crowd& crowd : all) {
    absl::StatusOr<Report> part = robots::measure(crowd, options.precision, count);
    if (!part.ok()) return part.status();
    report.append(*std::move(part));
  }
  if (!has_mujoco())
    report.misses.emplace_back(
        "this build has no MuJoCo to compare with: install libmujoco-dev, and configure it anew");
  return report;
}

}  // namespace tessera
