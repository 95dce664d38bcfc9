// Places: far away, at the last sector index, on a planet.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "cli/measure/local_world.h"
#include "cli/measure/positions.h"
#include "experiments/extremes/figures.h"
#include "experiments/extremes/scene_parts.h"
#include "experiments/paper/small_scenes.h"
#include "lpss/base/invariant.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera::extremes {
namespace {

constexpr std::int64_t kFar = std::int64_t{1} << 62;  // sectors
constexpr std::int64_t kFirst = std::numeric_limits<std::int64_t>::min();
constexpr std::int64_t kLast = std::numeric_limits<std::int64_t>::max();

Build moved(const Build& build, const SectorOffset& offset) {
  return [build, offset](const WorldSettings& settings) {
    WorldDescription world = build(settings);
    invariant(move_by(world, offset).ok(), "scenes are moved to valid sectors");
    return world;
  };
}

WorldDescription tower(const WorldSettings& settings) {
  return tower_world(settings, 10, Eigen::Vector3d::Zero());
}

WorldDescription chain(const WorldSettings& settings) {
  return chain_world(settings, 10, Eigen::Vector3d::Zero());
}

// The largest difference of a coordinate (m) or velocity (m/s) from the same scene at the origin.
Figure difference_from_origin(const Build& build) {
  return [build](const Moment& start, const Moment& now) {
    const WorldDescription world = build(now.settings);
    const absl::StatusOr<std::unique_ptr<LocalWorld>> local = in_sectors(world);
    if (!local.ok()) return std::numeric_limits<double>::infinity();
    (*local)->run(now.tick - start.tick);
    const std::vector<BodyRecord> records = (*local)->bodies();
    double difference =
        largest_distance(now.positions, positions_from({}, records, now.settings.sector_size));
    for (std::size_t i = 0; i < records.size(); ++i) {
      const Eigen::Vector3d velocity(records[i].state.linear_velocity.data());
      difference = std::max(difference, (now.velocity(i) - velocity).norm());
    }
    return difference;
  };
}

Scene far_scene(const std::string& name, const Build& build, std::int64_t sectors) {
  return {.group = "distance",
          .name = absl::StrCat(name, sectors > 0 ? "_at_2^62_sectors" : "_at_-2^62_sectors"),
          .world = moved(build, {sectors, sectors, sectors}),
          .lasts = {300, 300, 0},
          .asks = {difference_from_origin(build), "m or m/s", 0, "It moves as at the origin, bit for bit.",
                   "It moves differently than at the origin."}};
}

// --- the last sector of an axis ---

constexpr double kSectorSize = 128;             // m
constexpr double kFromBorder = 4;               // m, start of a body that leaves the range
constexpr double kHomeLag = kSectorSize / 512;  // m, how far a body may be outside its home sector

// A ball that moves out of the first or last sector along the z axis.
Build leaving(double speed, double gravity, int side) {
  const auto build = [=](const WorldSettings& given) {
    WorldSettings settings = given;
    settings.sector_size = kSectorSize;
    settings.gravity = UniformGravity{{0, 0, side * gravity}};
    WorldBuilder builder(settings);
    const Eigen::Vector3d place(1, 2, side * (kSectorSize / 2 - kFromBorder));
    builder.add("ball", builder.shape(Sphere{0.5}), 1, place).linear_velocity.z() = side * speed;
    return builder.world();
  };
  return moved(build, {0, 0, side > 0 ? kLast : kFirst});
}

// A body may be outside by the lag of its home sector and by its way during the ticks in which its move is
// announced, refused and undone.
double lateness(double speed) { return kHomeLag + 3 * speed * WorldSettings().time_step; }

void add_leaving(std::vector<Scene>& scenes, const std::string& name, double speed, double gravity,
                 int side) {
  Scene scene;
  scene.group = "last_sector";
  scene.name = absl::StrCat(name, "_comes_to_a_stop");
  scene.world = leaving(speed, gravity, side);
  scene.lasts = {600, 600};
  scene.asks = {[](const Moment&, const Moment& now) {
                  return std::max(0.0, std::abs(now.positions[0].z()) - kSectorSize / 2);
                },
                "m outside", lateness(std::hypot(speed, std::sqrt(2 * gravity * kFromBorder))),
                "It stops at the end of the world.", "It continues beyond the end of the world."};
  scenes.push_back(scene);

  scene.name = absl::StrCat(name, "_is_reported");
  scene.lasts.sample_every = 0;
  scene.asks = {[](const Moment&, const Moment& now) { return now.stopped > 0 ? 0.0 : 1.0; },
                "events missing", 0, "An event reports that it was stopped.",
                "No event reports that it was stopped."};
  scenes.push_back(scene);
}

Scene tower_in_last_sector(const std::string& name, std::int64_t sector) {
  Scene scene;
  scene.group = "last_sector";
  scene.name = name;
  scene.world = moved(
      [sector](const WorldSettings& settings) {
        const double at_border = (sector > 0 ? 1 : -1) * (settings.sector_size / 2 - 1);
        return tower_world(settings, 10, {at_border, 0, 0});
      },
      {sector, 0, 0});
  scene.lasts = {600, 600};
  scene.asks = {farthest, "m moved", 0.5, "A tower stands at the end of the world.",
                "A tower falls at the end of the world."};
  return scene;
}

Scene spawn_outside() {
  const auto outside = [](const WorldSettings& settings) {
    WorldDescription world = leaving(0, 0, 1)(settings);
    world.bodies[0].pose.position.local.z() = 2 * settings.sector_size;
    return world;
  };
  return refused_scene("last_sector", "start_outside", outside, "It runs, although there is no such place.");
}

// --- rest on a planet ---

constexpr double kEarthRadius = 6.371e6;                      // m
const Eigen::Vector3d kUp = Eigen::Vector3d(-1, -2, -2) / 3;  // not aligned with any axis

// A box at the anchor, on the far side of a planet; `plate`: on level ground instead of a ball of the
// planet's size.
Build on_planet(double radius, bool plate, bool sleeps) {
  return [=](const WorldSettings& given) {
    WorldSettings settings = sleeps ? given : sleepless(given);
    const absl::StatusOr<WorldPosition> centre = canonical({}, -radius * kUp, settings.sector_size);
    invariant(centre.ok(), "planets are within the range");
    settings.gravity = CentralGravity{*centre, kStandardGravity, radius};
    WorldBuilder builder(settings);
    const Eigen::Quaterniond upright = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), kUp);
    if (plate) {
      const ShapeId ground = builder.shape(Box{{20, 20, 2}});
      builder.add("ground", ground, 1, -kUp, Motion::kStatic).pose.orientation = upright;
    } else {
      builder.add("ground", builder.shape(Sphere{radius}), 1, -radius * kUp, Motion::kStatic);
    }
    builder.add("box", builder.shape(Box{{1, 1, 1}}), 100, 0.5 * kUp).pose.orientation = upright;
    return builder.world();
  };
}

Scene rest_on_planet(const std::string& name, const Build& world, double hours, double quick_hours) {
  constexpr double kTicksPerHour = 3600 * 60;
  Scene scene;
  scene.group = "planet";
  scene.name = name;
  scene.world = world;
  scene.lasts = {static_cast<Tick>(hours * kTicksPerHour), static_cast<Tick>(quick_hours * kTicksPerHour),
                 600};
  scene.asks = {[](const Moment& start, const Moment& now) {
                  const Eigen::Vector3d way = now.positions[0] - start.positions[0];
                  return (way - way.dot(kUp) * kUp).norm();
                },
                "m crept", 1e-3, "It stays in place.", "It creeps over the ground."};
  return scene;
}

// How far the box on a ball is from where it should lie.
Scene height_on_planet(const std::string& name, double radius) {
  Scene scene = rest_on_planet(name, on_planet(radius, false, false), 0.5, 0.02);
  scene.asks = {[radius](const Moment&, const Moment& now) {
                  return std::abs((now.positions[0] + radius * kUp).norm() - radius - 0.5);
                },
                "m off the ground", 1e-3, "It lies on the ground.", "It lies in the ground or above it."};
  return scene;
}

}  // namespace

std::vector<Scene> place_scenes() {
  std::vector<Scene> scenes;
  for (const std::int64_t sectors : {kFar, -kFar}) {
    scenes.push_back(far_scene("tower", tower, sectors));
    scenes.push_back(far_scene("chain", chain, sectors));
    scenes.push_back(far_scene("collision", collision_scene, sectors));
  }
  add_leaving(scenes, "ball_at_10_m/s", 10, 0, 1);
  add_leaving(scenes, "ball_at_100_km/s", 1e5, 0, -1);
  add_leaving(scenes, "falling_ball", 0, kStandardGravity, -1);
  scenes.push_back(tower_in_last_sector("tower_at_the_upper_end", kLast));
  scenes.push_back(tower_in_last_sector("tower_at_the_lower_end", kFirst));
  scenes.push_back(spawn_outside());
  scenes.push_back(rest_on_planet("box_24_h", on_planet(kEarthRadius, true, true), 24, 1));
  scenes.push_back(rest_on_planet("box_awake_2_h", on_planet(kEarthRadius, true, false), 2, 0.05));
  scenes.push_back(
      rest_on_planet("box_on_a_ball_as_large_as_earth", on_planet(kEarthRadius, false, false), 0.5, 0.02));
  scenes.push_back(rest_on_planet("box_on_a_ball_of_1_km", on_planet(1000, false, false), 0.5, 0.02));
  scenes.push_back(height_on_planet("height_on_a_ball_as_large_as_earth", kEarthRadius));
  scenes.push_back(height_on_planet("height_on_a_ball_of_1_km", 1000));
  return scenes;
}

}  // namespace tessera::extremes
