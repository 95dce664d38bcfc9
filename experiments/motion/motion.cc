#include "experiments/motion/motion.h"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "cli/measure/stopwatch.h"
#include "experiments/motion/crossings.h"
#include "experiments/motion/day.h"
#include "experiments/scenes.h"
#include "lpss/simulation/example_programs.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/partition_cluster.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

using Eigen::Vector3d;

constexpr double kMotionPull = 9.81;  // m/s^2
constexpr double kShipSpeeds[] = {30, 465, 7.8e3, 3e4, 3e7};
constexpr double kOrbital = 7.8e3;    // m/s
constexpr double kMotionSector = 16;  // m

WorldSettings motion_settings(const ExperimentOptions& options) {
  WorldSettings settings;
  settings.precision = options.precision;
  settings.sector_size = kMotionSector;
  return settings;
}

MovingFrame ship_at(double speed) {
  MovingFrame frame;
  frame.name = "ship";
  frame.velocity = speed * Vector3d(1, 2, 2) / 3;
  return frame;
}

struct MotionScene {
  std::string name;
  WorldDescription world;
};

std::vector<MotionScene> motion_scenes(const ExperimentOptions& options) {
  const WorldSettings settings = motion_settings(options);
  const int bodies = options.quick ? 60 : 400;
  return {{"tower", tower_world(settings, 10, {7, 7, 0})},
          {"pile", pile_world(settings, bodies)},
          {"pyramid", pyramid_world(settings, options.quick ? 6 : 20)},
          {"crowd", crowd_world(settings)},
          {"chain", chain_world(settings, 30, {0, 0, 20})}};
}

class TimedSteps {
 public:
  static absl::StatusOr<TimedSteps> create(const WorldDescription& world) {
    absl::StatusOr<std::unique_ptr<Simulation>> simulation = Simulation::create(world);
    if (!simulation.ok()) return simulation.status();
    TimedSteps timed;
    timed.simulation_ = *std::move(simulation);
    return timed;
  }

  void step() {
    ticks_us_.push_back(processor_us([&] { simulation_->step(); }));
  }
  void forget() { ticks_us_.clear(); }
  double tick_us() const { return median(ticks_us_); }
  Simulation& operator*() const { return *simulation_; }
  Simulation* operator->() const { return simulation_.get(); }

 private:
  std::unique_ptr<Simulation> simulation_;
  std::vector<double> ticks_us_;
};

using TickHashes = std::vector<WorldHash>;

absl::StatusOr<bool> has_hashes(const WorldDescription& world, std::uint32_t partitions,
                                const TickHashes& hashes) {
  auto cluster = PartitionCluster::create(world, partitions, /*threads=*/1);
  if (!cluster.ok()) return cluster.status();
  for (const WorldHash& hash : hashes) {
    (*cluster)->step();
    if ((*cluster)->hash() != hash) return false;
  }
  return true;
}

absl::StatusOr<Report> at_all_speeds(const ExperimentOptions& options, const MotionScene& scene) {
  const int ticks = options.quick ? 60 : 300;
  Report report;
  for (const double speed : kShipSpeeds) {
    const WorldDescription world = aboard(ship_at(speed), scene.world);
    absl::StatusOr<TimedSteps> still = TimedSteps::create(aboard(ship_at(0), scene.world));
    if (!still.ok()) return still.status();
    absl::StatusOr<TimedSteps> moving = TimedSteps::create(world);
    if (!moving.ok()) return moving.status();
    bool same = true;
    TickHashes hashes;
    for (int tick = 0; tick < ticks; ++tick) {
      TimedSteps& first = tick % 2 == 0 ? *still : *moving;
      TimedSteps& second = tick % 2 == 0 ? *moving : *still;
      first.step();
      second.step();
      hashes.push_back((*still)->hash());
      same = same && (*moving)->hash() == hashes.back();
    }
    for (const std::uint32_t partitions : {2u, 4u}) {
      const absl::StatusOr<bool> equal = has_hashes(world, partitions, hashes);
      if (!equal.ok()) return equal.status();
      same = same && *equal;
    }
    report.table("rows").push_back({{"engine", name_of(options.precision)},
                                    {"scene", scene.name},
                                    {"speed", speed},
                                    {"ticks", ticks},
                                    {"tick_us", moving->tick_us()},
                                    {"ratio", moving->tick_us() / still->tick_us()},
                                    {"hash", hashes.back().to_string()},
                                    {"same", same}});
    if (!same) report.misses.push_back(absl::StrCat(scene.name, " at ", speed, " m/s: other bits"));
  }
  return report;
}

// Crates that come to rest beside a ball that rolls on.
WorldDescription crates(const ExperimentOptions& options, int count) {
  WorldSettings settings = motion_settings(options);
  settings.sector_size = 128;
  WorldBuilder builder(settings);
  builder.add("ground", builder.shape(Plane{}), 1, Vector3d::Zero(), Motion::kStatic);
  const ShapeId box = builder.shape(Box{{0.5, 0.5, 0.5}});
  for (int n = 0; n < count; ++n) {
    const int row = n / 25;
    builder.add(absl::StrCat("crate", n), box, 10, {n % 25 - 12.0, row - 10.0, 0.25});
  }
  builder.add("ball", builder.shape(Sphere{0.5}), 1, {-50, 40, 0.5}).linear_velocity.x() = 1;
  return builder.world();
}

absl::StatusOr<Report> asleep(const ExperimentOptions& options) {
  constexpr int kCrates = 500;
  const WorldDescription world = crates(options, kCrates);
  absl::StatusOr<TimedSteps> ground = TimedSteps::create(world);
  if (!ground.ok()) return ground.status();
  absl::StatusOr<TimedSteps> ship = TimedSteps::create(aboard(ship_at(kOrbital), world));
  if (!ship.ok()) return ship.status();
  constexpr int kTicksToRest = 300;
  for (int tick = 0; tick < 2 * kTicksToRest; ++tick) {
    if (tick == kTicksToRest) {
      ground->forget();
      ship->forget();
    }
    TimedSteps& first = tick % 2 == 0 ? *ground : *ship;
    TimedSteps& second = tick % 2 == 0 ? *ship : *ground;
    first.step();
    second.step();
  }
  Report report;
  const auto add = [&](const char* where, const TimedSteps& timed) {
    report.table("asleep").push_back({{"engine", name_of(options.precision)},
                                      {"where", where},
                                      {"bodies", kCrates},
                                      {"tick_us", timed.tick_us()},
                                      {"ratio", timed.tick_us() / ground->tick_us()}});
  };
  add("ground", *ground);
  add("ship", *ship);
  return report;
}

struct Braking {
  double braking = 0;  // m/s^2
  double friction = 0;
};

constexpr double kBrakes = 2;  // s
constexpr double kBegins = 3;  // s, when all sleep
constexpr int kBoxesInRow = 50;

WorldDescription train(const ExperimentOptions& options, const Braking& braking, int boxes) {
  WorldBuilder builder(motion_settings(options));
  builder.add("floor", builder.shape(Plane{}), 1, Vector3d::Zero(), Motion::kStatic).properties.friction =
      braking.friction;
  const ShapeId box = builder.shape(Box{{0.5, 0.5, 0.3}});
  for (int n = 0; n < boxes; ++n) {
    const int row = n / kBoxesInRow;
    const Vector3d place(2.0 * (n % kBoxesInRow), row, 0.15);
    builder.add(absl::StrCat("box", n), box, 10, place).properties.friction = braking.friction;
  }
  MovingFrame frame = ship_at(0);
  frame.velocity = {30, 0, 0};
  frame.legs = {{kBegins, Vector3d::Zero()}, {kBrakes, {-braking.braking, 0, 0}}};
  return aboard(frame, builder.world());
}

// m, until they stand again.
double way_of(const Braking& braking) {
  const double held = braking.friction * kMotionPull;
  const double past = std::max(braking.braking - held, 0.0);
  const double speed = past * kBrakes;
  return speed * kBrakes / 2 + speed * speed / (2 * held);
}

absl::StatusOr<Report> brakes(const ExperimentOptions& options, const Braking& braking) {
  const int boxes = options.quick ? 100 : 1000;
  absl::StatusOr<std::unique_ptr<Simulation>> simulation = Simulation::create(train(options, braking, boxes));
  if (!simulation.ok()) return simulation.status();
  const double dt = (*simulation)->partition().dt();
  const auto run_for = [&](double seconds) {
    for (long tick = 0; tick < std::lround(seconds / dt); ++tick) (*simulation)->step();
  };
  run_for(kBegins);
  (*simulation)->step();
  int woken = 0;
  (*simulation)->for_each_body([&](const BodyRecord& body) {
    woken += body.state.activity == Activity::kAsleep ? 0 : 1;
  });
  run_for(8);
  double slid = 0;
  int n = 0;
  (*simulation)->for_each_body([&](const BodyRecord& body) {
    const double x = metres_between({0, 0, 0, 1}, body.home, kMotionSector).x() + body.state.position[0];
    slid += (x - 2.0 * (n++ % kBoxesInRow)) / boxes;
  });
  Report report;
  const double right = way_of(braking);
  report.table("brakes").push_back({{"engine", name_of(options.precision)},
                                    {"braking", braking.braking},
                                    {"friction", braking.friction},
                                    {"boxes", boxes},
                                    {"woken", woken},
                                    {"slid", slid},
                                    {"right", right},
                                    {"error", slid - right}});
  if (woken != boxes)
    report.misses.push_back(absl::StrCat(boxes - woken, " boxes sleep while the train brakes"));
  return report;
}

struct MotionPart {
  std::string group;
  std::string name;
  std::function<absl::StatusOr<Report>()> measure;
};

}  // namespace

absl::StatusOr<Report> measure_motion(const ExperimentOptions& options, const Progress& progress) {
  constexpr Braking kBraking[] = {{2, 0.5}, {4, 0.25}, {6, 0.3}};
  // The last one turns.
  constexpr std::pair<double, double> kPassing[] = {{0, 0},     {30, 0},  {465, 0},
                                                    {7.8e3, 0}, {3e4, 0}, {30, 0.2}};
  std::vector<MotionPart> parts;
  for (const MotionScene& scene : motion_scenes(options))
    parts.push_back({"speeds", scene.name, [&options, scene] { return at_all_speeds(options, scene); }});
  parts.push_back({"sleep", "crates", [&] { return asleep(options); }});
  for (const Braking& braking : kBraking)
    parts.push_back(
        {"brakes", absl::StrCat(braking.braking, " m/s^2"), [&] { return brakes(options, braking); }});
  for (const auto& passing : kPassing) {
    parts.push_back({"crossings", absl::StrCat(passing.first, " m/s"),
                     [&] { return measure_crossings(options, passing.first, passing.second); }});
  }
  parts.push_back({"orbit", "day", [&] { return measure_day(options); }});
  if (absl::Status status = choose(options.only, parts); !status.ok()) return status;
  return measure_each(parts, progress, [](const MotionPart& part) { return part.measure(); });
}

}  // namespace tessera
