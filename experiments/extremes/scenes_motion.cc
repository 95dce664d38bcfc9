// How bodies move: speeds, orbits, spins, bounces.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "experiments/extremes/figures.h"
#include "experiments/extremes/scene_parts.h"
#include "lpss/base/invariant.h"
#include "lpss/model/body.h"
#include "lpss/model/limits.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera::extremes {
namespace {

std::string in_words(double speed) {
  return speed < 1000 ? absl::StrCat(speed, "_m/s") : absl::StrCat(speed / 1000, "_km/s");
}

// --- hits ---

struct Shot {
  std::string name;
  std::function<void(WorldBuilder& builder)> add_target;  // at the origin, in the path of the ball along x
  bool target_moves = false;
  double radius = 0.5;  // m, of the ball
  int direction = 1;    // along x
};

// The ball starts some ticks away, such that it hits the target between two ticks.
Scene shot_scene(const Shot& shot, double speed) {
  Scene scene;
  scene.group = "speed";
  scene.name = absl::StrCat(shot.name, "_at_", in_words(speed));
  scene.world = [shot, speed](const WorldSettings& given) {
    const WorldSettings settings = weightless(given);
    WorldBuilder builder(settings);
    const double away = 5 + 2.37 * speed * settings.time_step;
    BodyDescription& ball =
        builder.add("ball", builder.shape(Sphere{shot.radius}), 1, {-shot.direction * away, 0.013, 0.017});
    ball.linear_velocity.x() = shot.direction * speed;
    shot.add_target(builder);
    return builder.world();
  };
  scene.lasts = {120, 120};
  if (shot.target_moves) {
    // After a hit without bounce, ball and target, which are equally heavy, move on at half the speed.
    scene.lasts.sample_every = 0;
    scene.asks.figure = [shot, speed](const Moment&, const Moment& now) {
      return std::abs(shot.direction * now.velocity(0).x() / speed - 0.5);
    };
    scene.asks.unit = "relative deviation from half its speed";
    scene.asks.bound = 0.1;
    scene.asks.holds = "It hits.";
  } else {
    scene.asks.figure = [shot](const Moment&, const Moment& now) {
      return shot.direction * now.positions[0].x();
    };
    scene.asks.unit = "m past the target";
    scene.asks.holds = "It is stopped.";
  }
  scene.asks.fails = "It tunnels through.";
  return scene;
}

void add_wall(WorldBuilder& builder) {
  builder.add("wall", builder.shape(Box{{0.1, 20, 20}}), 1, Eigen::Vector3d::Zero(), Motion::kStatic);
}

void add_sheet(WorldBuilder& builder) {
  TriangleMesh mesh;
  mesh.vertices = {{0, -10, -10}, {0, 10, -10}, {0, 10, 10}, {0, -10, 10}};
  mesh.indices = {0, 1, 2, 0, 2, 3};
  builder.add("sheet", builder.shape(mesh), 1, Eigen::Vector3d::Zero(), Motion::kStatic);
}

void add_plate(WorldBuilder& builder) {
  builder.add("plate", builder.shape(Box{{0.01, 1, 1}}), 1, Eigen::Vector3d::Zero(), Motion::kStatic);
}

void add_cube(WorldBuilder& builder) {
  builder.add("cube", builder.shape(Box{{1, 1, 1}}), 1, Eigen::Vector3d::Zero());
}

void add_shots(std::vector<Scene>& scenes) {
  for (const double speed : {1e1, 1e2, 1e3, 1e4, 3e4, 1e5}) {
    scenes.push_back(shot_scene({"wall", add_wall}, speed));
    scenes.push_back(shot_scene({"mesh", add_sheet}, speed));
    scenes.push_back(shot_scene({"bullet", add_plate, false, 0.005}, speed));
    scenes.push_back(shot_scene({"free_cube_upwards", add_cube, true, 0.5, 1}, speed));
    scenes.push_back(shot_scene({"free_cube_downwards", add_cube, true, 0.5, -1}, speed));
  }
}

// --- free flight and orbits ---

// Rounding in every tick may add up to the required resolution.
Scene flight_scene(double speed) {
  Scene scene;
  scene.group = "speed";
  scene.name = absl::StrCat("free_flight_at_", in_words(speed));
  scene.world = [speed](const WorldSettings& given) {
    WorldBuilder builder(weightless(given));
    builder.add("ball", builder.shape(Sphere{0.5}), 1, Eigen::Vector3d::Zero()).linear_velocity.x() = speed;
    return builder.world();
  };
  scene.lasts = {600, 600};
  scene.asks = {[speed](const Moment&, const Moment& now) {
                  return (now.positions[0] - Eigen::Vector3d(speed * now.time, 0, 0)).norm();
                },
                "m off its path", kResolutionWanted * static_cast<double>(scene.lasts.ticks),
                "It flies straight, through several sectors per tick.", "It leaves its path."};
  return scene;
}

// A circular orbit around a planet, in a plane not aligned with any axis.
struct Orbit {
  std::string name;
  double radius = 0;  // m
  double pull = 0;    // m/s^2, at that radius

  double speed() const { return std::sqrt(pull * radius); }
  double rate() const { return speed() / radius; }  // rad/s
  double period() const { return 2 * std::numbers::pi / rate(); }
};

constexpr double kOrbitTimeStep = 0.02;                         // s
const Eigen::Vector3d kOutward = Eigen::Vector3d(1, 2, 2) / 3;  // from the planet to the start
const Eigen::Vector3d kAhead = Eigen::Vector3d(2, 1, -2) / 3;

// Displacement from the start. 1 - cos is written such that no digits cancel.
Eigen::Vector3d way_on(const Orbit& orbit, double time) {
  const double angle = orbit.rate() * time;
  return orbit.radius * (std::sin(angle) * kAhead - 2 * std::pow(std::sin(angle / 2), 2) * kOutward);
}

WorldDescription satellite(const WorldSettings& given, const Orbit& orbit) {
  WorldSettings settings = given;
  settings.time_step = kOrbitTimeStep;
  const absl::StatusOr<WorldPosition> centre = canonical({}, -orbit.radius * kOutward, settings.sector_size);
  invariant(centre.ok(), "planets are within the range");
  settings.gravity = CentralGravity{*centre, orbit.pull, orbit.radius};
  WorldBuilder builder(settings);
  builder.add("satellite", builder.shape(Sphere{0.5}), 100, Eigen::Vector3d::Zero()).linear_velocity =
      orbit.speed() * kAhead;
  return builder.world();
}

Scene orbit_scene(const Orbit& orbit, double orbits, double quick_orbits) {
  Scene scene;
  // First-order error of the time step, which does not accumulate: 2e-5 in the lowest orbit.
  scene.group = "orbit";
  scene.name = orbit.name;
  scene.world = [orbit](const WorldSettings& settings) { return satellite(settings, orbit); };
  scene.lasts = {static_cast<Tick>(orbits * orbit.period() / kOrbitTimeStep),
                 static_cast<Tick>(quick_orbits * orbit.period() / kOrbitTimeStep), 1000};
  scene.asks = {[orbit](const Moment&, const Moment& now) {
                  return std::abs((now.positions[0] + orbit.radius * kOutward).norm() / orbit.radius - 1);
                },
                "relative deviation from its radius", std::max(1e-4, 2 * orbit.rate() * kOrbitTimeStep),
                "It keeps its orbit.", "It leaves its orbit."};
  return scene;
}

// Part of an orbit that is too long to simulate: the relative error of the fall towards the planet.
Scene arc_scene(const Orbit& orbit, Tick ticks, Tick quick_ticks) {
  Scene scene = orbit_scene(orbit, 0, 0);
  scene.lasts = {ticks, quick_ticks, 0};
  scene.asks = {[orbit](const Moment&, const Moment& now) {
                  const Eigen::Vector3d expected = way_on(orbit, now.time);
                  const Eigen::Vector3d fall = expected - orbit.speed() * now.time * kAhead;
                  return (now.positions[0] - expected).norm() / fall.norm();
                },
                "relative error of its fall", 0.01, "It falls along its orbit.",
                "It does not fall along its orbit."};
  return scene;
}

void add_orbits(std::vector<Scene>& scenes) {
  scenes.push_back(orbit_scene({"low_earth_orbit_7.7_km/s", 6.771e6, 8.694}, 3, 0.25));
  scenes.push_back(orbit_scene({"geostationary_orbit_3.1_km/s", 4.2164e7, 0.2242}, 0.25, 0.01));
  scenes.push_back(orbit_scene({"hundred_times_around_a_dwarf_star_30_km/s", 1e6, 900}, 100, 5));
  scenes.push_back(arc_scene({"path_of_the_moon_1_km/s", 3.844e8, 0.0027}, 1'000'000, 50'000));
  scenes.push_back(arc_scene({"path_of_earth_30_km/s", 1.5e11, 0.006}, 1'000'000, 50'000));
}

// --- spins ---

constexpr double kRodLength = 2;  // m

// A thin rod along x.
BodyDescription& add_rod(WorldBuilder& builder, const Eigen::Vector3d& place, const Eigen::Vector3d& spin) {
  BodyDescription& rod = builder.add("rod", builder.shape(Box{{kRodLength, 0.05, 0.05}}), 40, place);
  rod.angular_velocity = spin;
  return rod;
}

Scene spin_scene(const std::string& name, const Eigen::Vector3d& spin) {
  Scene scene;
  scene.group = "spin";
  scene.name = absl::StrCat(name, "_at_", spin.norm(), "_rad/s");
  scene.world = [spin](const WorldSettings& given) {
    WorldBuilder builder(weightless(given));
    add_rod(builder, Eigen::Vector3d::Zero(), spin);
    return builder.world();
  };
  scene.lasts = {600, 120};
  return scene;
}

// Free spin about a principal axis is constant; the body turns by rate times time.
void add_free_spin(std::vector<Scene>& scenes, const std::string& name, const Eigen::Vector3d& axis,
                   double rate) {
  Scene scene = spin_scene(name, rate * axis);
  scene.name += "_keeps_its_rate";
  scene.asks = {[spin = Eigen::Vector3d(rate * axis)](const Moment&, const Moment& now) {
                  return (now.spin(0) - spin).norm() / spin.norm();
                },
                "relative change of its rate", 1e-3, "Its spin stays constant.",
                "Its spin changes, although nothing touches it."};
  scenes.push_back(scene);

  scene = spin_scene(name, rate * axis);
  scene.name += "_turns_as_far";
  scene.asks = {[axis, rate](const Moment&, const Moment& now) {
                  const double angle = std::remainder(rate * now.time, 2 * std::numbers::pi);
                  const Eigen::Quaterniond expected(Eigen::AngleAxisd(angle, axis));
                  return expected.angularDistance(quaternion_of(now.bodies[0].state));
                },
                "rad off", 0.1, "It turns at its full spin.", "It does not turn at its full spin."};
  scenes.push_back(scene);
}

// A brick spinning about its intermediate axis tumbles, but keeps its angular momentum and energy.
void add_tumbling(std::vector<Scene>& scenes, double rate) {
  Scene scene;
  scene.group = "spin";
  scene.world = [rate](const WorldSettings& given) {
    WorldBuilder builder(weightless(given));
    builder.add("brick", builder.shape(Box{{1, 0.6, 0.2}}), 10, Eigen::Vector3d::Zero()).angular_velocity =
        Eigen::Vector3d(0.01, 1, 0.01).normalized() * rate;
    return builder.world();
  };
  scene.lasts = {600, 120};
  scene.asks = {[](const Moment& start, const Moment& now) {
                  const Eigen::Vector3d before = angular_momentum(start.bodies[0]);
                  return (angular_momentum(now.bodies[0]) - before).norm() / before.norm();
                },
                "relative change", 0.01, "Its angular momentum stays constant.",
                "Its angular momentum changes, although nothing touches it."};
  scene.name = absl::StrCat("tumbling_brick_at_", rate, "_rad/s_keeps_its_angular_momentum");
  scenes.push_back(scene);

  scene.name = absl::StrCat("tumbling_brick_at_", rate, "_rad/s_keeps_its_energy");
  scene.asks.figure = energy_change(0);
  scene.asks.holds = "Its energy stays constant.";
  scene.asks.fails = "Its energy changes, although nothing touches it.";
  scenes.push_back(scene);
}

// Contacts may take energy from a body, but never add any.
Scene spin_on_floor(const std::string& name, const Eigen::Vector3d& spin) {
  Scene scene;
  scene.group = "spin";
  scene.name = absl::StrCat(name, "_on_a_floor_at_", spin.norm(), "_rad/s");
  scene.world = [spin](const WorldSettings& settings) {
    WorldBuilder builder(settings);
    builder.add("floor", builder.shape(Plane{}), 1, Eigen::Vector3d::Zero(), Motion::kStatic);
    add_rod(builder, {0, 0, 1.1}, spin);
    return builder.world();
  };
  scene.lasts = {1200, 300};
  scene.asks = {energy_gain(kStandardGravity), "relative energy gain", 0.01,
                "It gains no energy from hitting the floor.", "It gains energy from hitting the floor."};
  return scene;
}

void add_spins(std::vector<Scene>& scenes) {
  for (const double rate : {10.0, 40.0, 100.0, 1000.0}) {
    add_free_spin(scenes, "rod_about_its_length", Eigen::Vector3d::UnitX(), rate);
    add_free_spin(scenes, "rod_end_over_end", Eigen::Vector3d::UnitY(), rate);
  }
  for (const double rate : {10.0, 100.0, 1000.0}) {
    add_tumbling(scenes, rate);
    scenes.push_back(spin_on_floor("rod_end_over_end", {0, rate, 0}));
    scenes.push_back(spin_on_floor("flat_rod", {0, 0, rate}));
  }
}

// --- bounces ---

constexpr double kBounces = 1e5;
constexpr double kQuickBounces = 5e3;

Scene bounce_scene(const std::string& name, Build world, double ticks_per_bounce, double gravity) {
  return {.group = "bounce",
          .name = name,
          .world = std::move(world),
          .lasts = {static_cast<Tick>(kBounces * ticks_per_bounce),
                    static_cast<Tick>(kQuickBounces * ticks_per_bounce), 100},
          .asks = {energy_change(gravity), "relative energy change", 0.01, "It keeps its energy.",
                   "Its energy changes."}};
}

constexpr double kFloor = -0.5;  // m: the ball's centre is at 0 when it touches

void add_bouncing_ball(WorldBuilder& builder, const Eigen::Vector3d& velocity) {
  builder.add_floor(5, kFloor);
  builder.add("ball", builder.shape(Sphere{-kFloor}), 1, {0, 0, 1}).linear_velocity = velocity;
}

WorldDescription elastic(WorldDescription world) {
  for (BodyDescription& body : world.bodies) {
    body.properties.restitution = 1;
    body.properties.friction = 0;
  }
  return world;
}

void add_bounces(std::vector<Scene>& scenes) {
  constexpr double kHeight = 1;      // m, of the fall
  constexpr double kSpeed = 10;      // m/s, between the walls
  constexpr double kBetween = 2.03;  // m; one bounce every 6.2 ticks
  const double ticks_per_second = 1 / WorldSettings().time_step;
  scenes.push_back(bounce_scene(
      "under_gravity",
      [](const WorldSettings& given) {
        WorldBuilder builder(sleepless(given));
        add_bouncing_ball(builder, Eigen::Vector3d::Zero());
        return elastic(builder.world());
      },
      2 * std::sqrt(2 * kHeight / kStandardGravity) * ticks_per_second, kStandardGravity));
  scenes.push_back(bounce_scene(
      "between_two_walls",
      [](const WorldSettings& given) {
        WorldBuilder builder(weightless(given));
        add_bouncing_ball(builder, {0, 0, -kSpeed});
        builder.add_floor(5, kFloor + kBetween + 2);
        return elastic(builder.world());
      },
      (kBetween - 1) / kSpeed * ticks_per_second, 0));
}

}  // namespace

std::vector<Scene> motion_scenes() {
  std::vector<Scene> scenes;
  add_shots(scenes);
  for (const double speed : {3e4, 1e5}) scenes.push_back(flight_scene(speed));
  add_orbits(scenes);
  add_spins(scenes);
  add_bounces(scenes);
  return scenes;
}

}  // namespace tessera::extremes
