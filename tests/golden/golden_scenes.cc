#include "tests/golden/golden_scenes.h"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <filesystem>
#include <random>

#include "lpss/base/portable_math.h"
#include "lpss/programs/module.h"
#include "lpss/simulation/example_worlds.h"
#include "worlds/loader/world_file.h"

namespace tessera {
namespace {

WorldSettings sectors_of(double size) {
  WorldSettings settings;
  settings.sector_size = size;
  return settings;
}

GoldenScene from_file(const std::string& name, Tick ticks) {
  return {name, ticks, [name]() -> absl::StatusOr<WorldDescription> {
            const absl::StatusOr<LoadedWorld> loaded =
                load_world_file(std::filesystem::path(TESSERA_OWN_WORLDS) / (name + ".sdf"));
            if (!loaded.ok()) return loaded.status();
            return loaded->world;
          }};
}

// The world flee, whose program is compiled from another language: it has the hash of the one in C.
GoldenScene flee_in(const std::string& language) {
  GoldenScene scene = from_file("flee", 300);
  scene.name = absl::StrCat("flee_", language);
  scene.world = [of_c = scene.world, file = scene.name + ".wasm"]() -> absl::StatusOr<WorldDescription> {
    absl::StatusOr<WorldDescription> world = of_c();
    if (!world.ok()) return world;
    const auto module =
        load_module_file(std::filesystem::path(TESSERA_OWN_WORLDS) / "programs" / "languages" / file);
    if (!module.ok()) return module.status();
    const std::string before = world->settings.modules.at(0)->kind;
    for (BodyDescription& body : world->bodies) {
      for (ProgramRecord& record : body.programs) {
        if (record.kind == before) record.kind = (*module)->kind;
      }
    }
    world->settings.modules = {*module};
    return world;
  };
  return scene;
}

// A box that is pushed across a seam by a kinematic body, first at a set velocity, later along kinematic
// targets.
WorldDescription pusher_world() {
  WorldBuilder builder(sectors_of(8));
  builder.add_floor(30, -2);
  builder.add("box", builder.shape(Box{{1, 1, 1}}), 1, {2, 0, -1.5});
  builder.add("pusher", builder.shape(Box{{0.5, 3, 1}}), 1, {1, 0, -1.4}, Motion::kKinematic)
      .linear_velocity = {1, 0, 0};
  return builder.world();
}

std::vector<Command> pusher_commands(Tick tick) {
  if (tick <= 60) return {};
  BodyState goal;
  goal.position = {2 + 0.02 * static_cast<double>(tick - 60),
                   0.2 * portable::sincos(0.1 * static_cast<double>(tick)).sin, -1.4};
  return {KinematicTarget{BodyId{3}, {}, goal}};
}

// A stack that falls asleep across a seam (before tick 300) and is woken from above.
WorldDescription sleeping_world() { return tower_world(sectors_of(4), 6, {0, 0, -1}); }

std::vector<Command> sleeping_commands(Tick tick) {
  if (tick != 300) return {};
  return {ApplyImpulse{BodyId{7}, {2, 1, 0}, {0, 0, 0.3}}};
}

// Every kind of command that changes bodies.
std::vector<Command> busy_client(Tick tick) {
  BodyRecord spawned;
  spawned.id = BodyId{1000};
  spawned.properties.shape = 1;
  spawned.properties.inertia = {0.1, 0.1, 0.1};
  spawned.state.position = {7, 7, 7.5};
  BodyState elsewhere;
  elsewhere.position = {7.5, -7.9, 3};
  elsewhere.linear_velocity = {0, 0, -2};
  switch (tick) {
    case 20:
      return {SpawnBody{spawned}, ApplyImpulse{BodyId{1000}, {2, 1, 0}, {0.1, 0, 0}}};
    case 40:
      return {RemoveBody{BodyId{7}}, SetVelocity{BodyId{9}, {3, 0, 4}, {0, 0, 1}}};
    case 60:
      return {Teleport{BodyId{12}, {2, 0, 0}, elsewhere},
              ApplyForce{BodyId{13}, Wrench{{0, 0, 500}, {1, 0, 0}}}};
    case 80:
      return {RemoveBody{BodyId{1}}};  // the floor
    default:
      return {};
  }
}

// Tumbling bodies around a planet, most of them alone; some collide.
WorldDescription orbit_world() {
  WorldSettings settings = sectors_of(16);
  settings.gravity = CentralGravity{{{0, 0, -100'000}, {0, 0, 0}}, 9.81, 1.6e6};
  WorldBuilder builder(settings);
  const ShapeId ball = builder.shape(Sphere{0.5});
  const ShapeId brick = builder.shape(Box{{1, 1.4, 0.6}});
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3d place(6.7 * (i % 4), 7.1 * (i / 4 % 4), 6.3 * (i / 16));
    BodyDescription& body = builder.add(absl::StrCat("body", i), i % 2 == 0 ? ball : brick, 1 + i % 5, place);
    body.linear_velocity = Eigen::Vector3d(i % 7 - 3, i % 5 - 2, i % 11 - 5) * 1.7;
    body.angular_velocity = Eigen::Vector3d(i % 3 - 1, i % 4 - 2, i % 5 - 2) * 1.1;
  }
  return builder.world();
}

// One joint of every type with an axis, with every kind of drive, each across a border between sectors.
WorldDescription machine_world() {
  WorldBuilder builder(sectors_of(4));
  builder.add_floor(30, -3);
  const ShapeId arm = builder.shape(Box{{1.5, 0.2, 0.2}});
  const auto add = [&](const std::string& name, JointType type, double y, const Eigen::Vector3d& axis,
                       const JointDrive& drive) -> JointDescription& {
    builder.add(absl::StrCat(name, "_base"), arm, 5, {1, y, 1});
    builder.add(absl::StrCat(name, "_arm"), arm, 1, {2.6, y, 1});
    builder.tie(absl::StrCat(name, "_mount"), JointType::kFixed, "", absl::StrCat(name, "_base"),
                {0.2, y, 1});
    JointDescription& joint =
        builder.tie(name, type, absl::StrCat(name, "_base"), absl::StrCat(name, "_arm"), {1.8, y, 1}, axis);
    joint.drives[0] = drive;
    joint.properties.axes[0].effort_max = 40;
    return joint;
  };
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  add("revolute", JointType::kRevolute, -6, y, {DriveMode::kVelocity, 2});
  add("prismatic", JointType::kPrismatic, -4.5, x, {DriveMode::kPosition, 0.4});
  add("universal", JointType::kUniversal, -3, y, {DriveMode::kEffort, 3});
  add("screw", JointType::kScrew, -1.5, x, {DriveMode::kVelocity, 3}).properties.pitch = 0.1;
  add("limited", JointType::kRevolute, 1.5, y, {}).properties.axes[0].lower = -0.5;
  JointDescription& rough = add("rough", JointType::kRevolute, 3, y, {});
  rough.properties.axes[0].friction = 2;
  rough.properties.axes[0].damping = 0.5;
  return builder.world();
}

// Shapes other than boxes on a terrain that is cut for each sector: a mesh, a height field, and a plane
// below.
WorldDescription terrain_world() {
  WorldBuilder builder(sectors_of(8));
  HeightField hills{41, 41, {1, 1}, {}};
  for (int row = 0; row < 41; ++row) {
    for (int column = 0; column < 41; ++column) {
      hills.heights.push_back(0.125 * ((column * 7 + row * 3) % 5) + 0.0625 * (row % 7));
    }
  }
  TriangleMesh ramp;
  ramp.vertices = {{-20, -20, 4}, {20, -20, 0.25}, {20, 20, 0.25}, {-20, 20, 4}};
  ramp.indices = {0, 1, 2, 0, 2, 3};
  builder.add("hills", builder.shape(std::move(hills)), 1, {0, 0, -1}, Motion::kStatic);
  builder.add("ramp", builder.shape(std::move(ramp)), 1, {-24, 0, -1}, Motion::kStatic);
  builder.add("ground", builder.shape(Plane{}), 1, {0, 0, -4}, Motion::kStatic);
  const ShapeId shapes[] = {
      builder.shape(Ellipsoid{{0.5, 0.4, 0.3}}),
      builder.shape(ConvexHull{{{-0.5, -0.5, -0.5}, {0.5, -0.5, -0.5}, {0, 0.5, -0.5}, {0, 0, 0.5}}}),
      builder.shape(Cylinder{0.3, 0.5}), builder.shape(Box{{0.5, 0.75, 0.25}}), builder.shape(Sphere{0.25})};
  builder.world().shapes.push_back(Shape{{{Sphere{0.3}, {{-0.4, 0, 0}, Eigen::Quaterniond::Identity()}},
                                          {Sphere{0.3}, {{0.4, 0, 0}, Eigen::Quaterniond::Identity()}}}});
  const auto dumbbell = static_cast<ShapeId>(builder.world().shapes.size() - 1);
  for (int i = 0; i < 30; ++i) {
    const ShapeId shape = i % 6 == 5 ? dumbbell : shapes[i % 6];
    BodyDescription& body =
        builder.add(absl::StrCat("body", i), shape, 1 + i % 3, {1.1 * (i % 6) + 1, 1.2 * (i / 6) + 1, 3.5});
    body.linear_velocity = {0.5 * (i % 3), -0.25 * (i % 4), -1};
    body.properties.restitution = 0.2 * (i % 3);
  }
  return builder.world();
}

// Tumbling shapes of every kind on a rough mesh: contacts with edges, corners and tilted faces.
WorldDescription rough_world() {
  WorldBuilder builder(sectors_of(16));
  std::mt19937_64 random(5);
  const auto number = [&random] {
    return std::ldexp(static_cast<double>(random() >> 11), -52) - 1;
  };  // -1 to 1
  // From the last coordinate to the first: the order in which a compiler evaluates arguments is its own.
  const auto flat = [&number](double z) {
    const double y = number();
    const double x = number();
    return Eigen::Vector3d(x, y, z);
  };
  constexpr std::uint32_t kCorners = 25;  // a side
  TriangleMesh rocks;
  for (std::uint32_t row = 0; row < kCorners; ++row) {
    for (std::uint32_t column = 0; column < kCorners; ++column) {
      const double height = 0.25 * number();
      rocks.vertices.emplace_back(0.75 * column - 9, 0.75 * row - 9, height);
      if (row + 1 == kCorners || column + 1 == kCorners) continue;
      const std::uint32_t corner = row * kCorners + column;
      for (const std::uint32_t step : {0u, 1u, kCorners + 1, 0u, kCorners + 1, kCorners})
        rocks.indices.push_back(corner + step);
    }
  }
  builder.add("rocks", builder.shape(std::move(rocks)), 1, {0, 0, -1}, Motion::kStatic);
  ConvexHull pebble;
  for (int n = 0; n < 12; ++n) pebble.points.push_back(0.4 * flat(number()).normalized());
  const ShapeId shapes[] = {builder.shape(Box{{0.7, 0.5, 0.4}}), builder.shape(Sphere{0.3}),
                            builder.shape(std::move(pebble)), builder.shape(Capsule{0.2, 0.5}),
                            builder.shape(Cylinder{0.3, 0.5})};
  for (int i = 0; i < 80; ++i) {
    Eigen::Vector3d place = 6 * flat(0);
    place.z() = 0.5 + 0.05 * i;
    BodyDescription& body = builder.add(absl::StrCat("body", i), shapes[i % 5], 1, place);
    body.linear_velocity = {2 * number(), 2 * number(), 0};
    body.angular_velocity = {3 * number(), 3 * number(), 3 * number()};
    body.properties.linear_damping = 0.05;
  }
  return builder.world();
}

// Balls that would tunnel through a thin wall between two ticks if they were not swept.
WorldDescription fast_world() {
  WorldBuilder builder(sectors_of(8));
  builder.add("wall", builder.shape(Box{{0.1, 40, 40}}), 1, {5, 0, 0}, Motion::kStatic);
  const ShapeId ball = builder.shape(Sphere{0.2});
  for (int i = 0; i < 12; ++i) {
    builder.add(absl::StrCat("ball", i), ball, 1, {-6, 1.5 * i - 8, 0.5 * (i % 5)}).linear_velocity = {
        60.0 + 12 * i, i % 3 - 1.0, 0};
  }
  return builder.world();
}

GoldenScene made(std::string name, Tick ticks, std::function<WorldDescription()> world,
                 std::function<std::vector<Command>(Tick)> commands = {}) {
  return {std::move(name), ticks, std::move(world), std::move(commands)};
}

}  // namespace

const std::vector<GoldenScene>& golden_scenes() {
  static const std::vector<GoldenScene> scenes = {
      from_file("airfield", 300),
      from_file("balance", 300),
      from_file("busy", 180),
      from_file("earth", 60),
      from_file("falling", 180),
      from_file("ferry", 420),
      from_file("flee", 300),
      flee_in("rs"),
      flee_in("ts"),
      from_file("fountain", 300),
      from_file("globe", 600),
      from_file("house", 300),
      from_file("habitat", 300),
      from_file("harbour", 300),
      from_file("machines", 180),
      from_file("orbit", 300),
      from_file("road", 300),
      from_file("rover", 300),
      from_file("seam", 180),
      from_file("station", 300),
      from_file("town", 60),
      from_file("voyage", 1500),
      from_file("workshop", 300),
      from_file("tower", 180),
      from_file("train", 840),
      from_file("tram", 900),
      from_file("zones", 180),
      made("tower_over_seams", 240,
           [] {
             return tower_world(sectors_of(4), 10, {0, 0, -1});
           }),
      made("chain_over_seams", 180,
           [] {
             return chain_world(sectors_of(2), 20, {0.3, 0.2, 0.4});
           }),
      made("pile_over_seams", 180, [] { return pile_world(sectors_of(16), 120); }),
      made("pile_of_clones", 180,
           [] {
             WorldSettings settings = sectors_of(16);
             settings.seams = SeamPolicy::kClone;
             return pile_world(settings, 60);
           }),
      made("pile_solved_by_bullet", 120,
           [] {
             WorldSettings settings = sectors_of(16);
             settings.seams = SeamPolicy::kClone;
             return pile_world(settings, 60);
           }),
      made(
          "commands", 160, [] { return pile_world(sectors_of(16), 60); }, busy_client),
      made("pusher", 240, pusher_world, pusher_commands),
      made("sleep_and_wake", 360, sleeping_world, sleeping_commands),
      made("orbits", 150, orbit_world),
      made("driven_joints", 150, machine_world),
      made("terrain", 150, terrain_world),
      made("rough_terrain", 240, rough_world),
      made("fast", 60, fast_world),
  };
  return scenes;
}

}  // namespace tessera
