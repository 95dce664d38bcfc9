// Programs: fields, portals, thrusters, wings, tracks and joints that break, against the formulas for them.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "experiments/truth/scene_parts.h"
#include "lpss/simulation/example_programs.h"

namespace tessera::truth {
namespace {

WorldBuilder without_gravity(const WorldSettings& settings) {
  return WorldBuilder(with_gravity(settings, {0, 0, 0}));
}

// A kinematic zone with a program, of which nothing is solved.
BodyDescription& add_zone(WorldBuilder& builder, const Eigen::Vector3d& size, const Eigen::Vector3d& place,
                          ProgramRecord program) {
  BodyDescription& zone = builder.add("zone", builder.shape(Box{size}), 1, place, Motion::kKinematic);
  zone.properties.trigger = true;
  zone.programs.push_back(std::move(program));
  return zone;
}

// v = w (1 - exp(-c t)), in a wind w along the border.
Scene blows_along() {
  Scene scene = program_scene("blows_along", 2);
  scene.has_order = true;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder = without_gravity(settings);
    add_zone(builder, {4.5, 4.5, 4.5}, {kPlace, 0, 0},
             example_program("field", {{"wind_y", 1.5}, {"damping", 1}}));
    add_body(builder, "ball", Sphere{0.1}, 2, {kPlace + 0.02, -1.9, 0.1}, 0.5);
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const double right = 1.5 * (1 - std::exp(-course.seconds()));
    return {{"speed", "m/s", right, course.last("ball").velocity.y(), 0.02 * right}};
  };
  return scene;
}

// A magnet and what it draws keep their momentum.
Scene draws() {
  Scene scene = program_scene("draws", 0.5);
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder = without_gravity(settings);
    BodyDescription& magnet = add_body(builder, "magnet", Sphere{2.5}, 3, {kPlace - 0.4, 0.1, 0}, 0.5);
    magnet.properties.trigger = true;
    magnet.programs.push_back(example_program("field", {{"radial", -4}, {"near", 0.5}, {"power", 2}}));
    add_body(builder, "steel", Sphere{0.1}, 1, {kPlace + 1.6, 0.1, 0.3}, 0.5).linear_velocity = {0.3, 0, 0};
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const Eigen::Vector3d momentum = 3 * course.last("magnet").velocity + course.last("steel").velocity;
    return {{"momentum", "N s", 0.3, momentum.x(), 1e-5},
            {"momentum across", "N s", 0, std::hypot(momentum.y(), momentum.z()), 1e-5}};
  };
  return scene;
}

// It falls the same 5 m again and again; with what it has been taken back, z = -g t^2 / 2.
Scene falls_for_ever() {
  Scene scene = program_scene("falls_for_ever", 4);
  static constexpr double kLoop = 5;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    add_zone(builder, {3, 3, 2}, {kPlace, 0, -4}, example_program("portal", {{"z", kLoop}}));
    add_body(builder, "ball", Sphere{0.1}, 1, {kPlace + 0.05, 0.2, 0}, 0.5);
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const double fallen = kGravity * course.seconds() * course.seconds() / 2;
    const double off = std::remainder(course.last("ball").place.z() + fallen, kLoop);
    return {{"speed", "m/s", kGravity * course.seconds(), course.last("ball").velocity.norm(), 1e-3},
            {"place", "m", 0, off, 1e-3}};
  };
  return scene;
}

// At full throttle it rises with F / m - g.
Scene takes_off() {
  Scene scene = program_scene("takes_off", 2);
  scene.has_order = true;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    add_body(builder, "rocket", Box{{0.5, 0.5, 1}}, 4, {kPlace, 0.2, 0}, 0.5)
        .programs.push_back(
            example_program("thruster", {{"rise", EIGEN_PI / 2}, {"force", 60}, {"throttle", 1}}));
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const double right = 60.0 / 4 - kGravity;
    const double time = course.seconds();
    return {{"speed", "m/s", right * time, course.last("rocket").velocity.z(), 1.1 * 15 * course.dt()},
            {"height", "m", right * time * time / 2, course.last("rocket").place.z(),
             1.1 * 15 * time * course.dt()}};
  };
  return scene;
}

// What falls flat comes to the speed at which m g = rho / 2 v^2 A (drag + 2).
Scene falls_flat() {
  Scene scene = program_scene("falls_flat", 10);
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    BodyDescription& plate = add_body(builder, "plate", Box{{1, 2, 0.1}}, 5, {kPlace, 0.2, 0}, 0.5);
    plate.properties.inertia = {1e9, 1e9, 1e9};  // it stays flat
    plate.programs.push_back(example_program("wing", {{"area", 2}, {"drag", 0.1}}));
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const double right = std::sqrt(2 * 5 * kGravity / (1.2 * 2 * 2.1));
    return {{"speed", "m/s", right, -course.last("plate").velocity.z(), 0.005 * right}};
  };
  return scene;
}

// With two wheels a side it turns on the spot at v b / (b^2 + a^2), b half of the width and a of the length.
Scene turns_on_the_spot() {
  Scene scene = program_scene("turns_on_the_spot", 6);
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder = on_plane(with_gravity(settings, {0, 0, -kGravity}), 0.5);
    add_body(builder, "tank", Box{{4, 1.6, 0.4}}, 2000, {kPlace, 0.2, 0.5}, 0.5)
        .programs.push_back(example_program(
            "tracks", {{"force", 1e6}, {"speed", 4}, {"wheels", 2}, {"stiffness", 6e4}, {"turn", 0.5}}));
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const double right = 2 * 1 / (1 * 1 + 1.5 * 1.5);
    return {{"rate", "rad/s", right, course.last("tank").spin.z(), 0.02 * right}};
  };
  return scene;
}

// What is put on a belt slides until it has its speed, v / (mu g), and is v^2 / (2 mu g) behind by then.
Scene is_carried_by_a_belt() {
  Scene scene = program_scene("is_carried_by_a_belt", 4);
  static constexpr double kSpeed = 1.5;
  static constexpr double kFriction = 0.3;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    BodyDescription& belt =
        builder.add("belt", builder.shape(Box{{7, 1, 1}}), 1, {kPlace, 0.2, -0.5}, Motion::kKinematic);
    belt.properties.friction = 1;
    belt.programs.push_back(example_program("belt", {{"speed", kSpeed}, {"acceleration", 1e4}}));
    add_body(builder, "crate", Box{{0.5, 0.5, 0.5}}, 3, {kPlace - 3, 0.2, 0.25}, kFriction);
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const double slides = kSpeed / (kFriction * kGravity);
    const double right = kSpeed * (4 - slides) + kSpeed * slides / 2;
    return {{"way", "m", right, course.last("crate").place.x() - (kPlace - 3), 4 * kSpeed * course.dt()},
            {"speed", "m/s", kSpeed, course.last("crate").velocity.x(), 1e-3}};
  };
  return scene;
}

// On two tracks it goes as fast as they run.
Scene goes_on_treads() {
  Scene scene = program_scene("goes_on_treads", 5);
  static constexpr double kSpeed = 0.8;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder = on_plane(with_gravity(settings, {0, 0, -kGravity}), 0.8);
    BodyDescription& hull = add_body(builder, "hull", Box{{1, 0.5, 0.2}}, 20, {kPlace, 0.2, 0.3}, 0.5);
    hull.programs.push_back(example_program(
        "treads", {{"left", 3}, {"right", 4}, {"separation", 0.8}, {"speed", kSpeed}, {"acceleration", 1}}));
    for (const auto& [name, y] : {std::pair{"left", 0.6}, std::pair{"right", -0.2}}) {
      add_body(builder, name, Box{{1, 0.1, 0.3}}, 5, {kPlace, y, 0.15}, 0.8);
      builder.tie(absl::StrCat(name, "_mount"), JointType::kFixed, "hull", name, {kPlace, y, 0.2});
    }
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const Glance& last = course.last("hull");
    const double right = kSpeed * 5 - kSpeed * kSpeed / 2;
    return {{"way", "m", right, last.place.x() - kPlace, 4 * kSpeed * course.dt()},
            {"speed", "m/s", kSpeed, last.velocity.x(), 0.01 * kSpeed}};
  };
  return scene;
}

// A weight hangs from a joint, and is pulled the harder the later: it tears when m g + c t is what it bears.
Scene tears() {
  Scene scene = program_scene("tears", 3);
  static constexpr double kMost = 40;  // N
  static constexpr double kRate = 10;  // N/s
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    add_body(builder, "weight", Sphere{0.2}, 2, {kPlace, 0.2, -1}, 0.5)
        .programs.push_back(example_program("breaker", {{"force", kMost}}));
    builder.tie("rope", JointType::kFixed, "", "weight", {kPlace, 0.2, 0});
    return builder.world();
  };
  scene.script = [](const Course& course) -> std::vector<Command> {
    return {ApplyForce{course.id("weight"), {{0, 0, -kRate * course.seconds()}, {}}}};
  };
  scene.results = [](const Course& course) -> Results {
    const std::vector<Glance>& all = course.of("weight");
    const auto falls = std::ranges::find_if(all, [](const Glance& g) { return g.velocity.norm() > 0.1; });
    const double torn = static_cast<double>(falls - all.begin()) * course.dt();
    return {{"time", "s", (kMost - 2 * kGravity) / kRate, torn, 3 * course.dt()}};
  };
  return scene;
}

}  // namespace

std::vector<Scene> force_scenes() {
  return {blows_along(),
          draws(),
          falls_for_ever(),
          takes_off(),
          falls_flat(),
          turns_on_the_spot(),
          is_carried_by_a_belt(),
          goes_on_treads(),
          tears()};
}

}  // namespace tessera::truth
