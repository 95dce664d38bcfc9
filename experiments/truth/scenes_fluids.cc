// Programs of what swims and flies, against the formulas of fluids and of flight.
#include <algorithm>
#include <cmath>
#include <string>

#include "experiments/truth/scene_parts.h"
#include "lpss/simulation/example_programs.h"

namespace tessera::truth {
namespace {

WorldBuilder weightless(const WorldSettings& settings) {
  return WorldBuilder(with_gravity(settings, {0, 0, 0}));
}

// With added mass M and drag d, m g = (m + M) v' + d v: v = m g / d (1 - exp(-d t / (m + M))).
Scene sinks() {
  Scene scene = program_scene("sinks", 3);
  static constexpr double kMass = 2;
  static constexpr double kAdded = 5;  // more than its own, as of a plate
  static constexpr double kDrag = 4;   // N s/m
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    add_body(builder, "stone", Box{{1, 1, 0.2}}, kMass, {kPlace, 0.2, 0}, 0.5)
        .programs.push_back(example_program("hydrodynamics", {{"mass_z", kAdded}, {"drag_z", kDrag}}));
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const auto right = [&](double t) {
      return kMass * kGravity / kDrag * (1 - std::exp(-kDrag * t / (kMass + kAdded)));
    };
    // It falls freely for a tick before the water acts.
    const double early = kGravity * course.dt();
    return {{"speed after 1 s", "m/s", right(1), -course.at("stone", 1).velocity.z(), early},
            {"speed after 3 s", "m/s", right(3), -course.last("stone").velocity.z(), early}};
  };
  return scene;
}

// With quadratic drag c alone, v = v0 / (1 + c v0 t / m); a current is where it comes to rest.
Scene coasts() {
  Scene scene = program_scene("coasts", 5);
  static constexpr double kSpeed = 3;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder = weightless(settings);
    BodyDescription& hull = add_body(builder, "hull", Box{{2, 0.5, 0.5}}, 40, {kPlace, 0.2, 0}, 0.5);
    hull.linear_velocity = {kSpeed, 0, 0};
    hull.programs.push_back(example_program("hydrodynamics", {{"square_drag_x", 20}}));
    add_body(builder, "buoy", Sphere{0.3}, 10, {kPlace, 5, 0}, 0.5)
        .programs.push_back(example_program(
            "hydrodynamics", {{"drag_x", 30}, {"drag_y", 30}, {"current_x", 0.4}, {"current_y", -0.3}}));
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const double right = kSpeed / (1 + 20.0 / 40 * kSpeed * 5);
    const Eigen::Vector3d buoy = course.last("buoy").velocity;
    return {{"speed", "m/s", right, course.last("hull").velocity.x(), 0.01 * kSpeed},
            {"drift along x", "m/s", 0.4, buoy.x(), 1e-4},
            {"drift along y", "m/s", -0.3, buoy.y(), 1e-4}};
  };
  return scene;
}

// About an axis with drag d and added inertia J: w = w0 exp(-d t / (I + J)).
Scene stops_turning() {
  Scene scene = program_scene("stops_turning", 2);
  static constexpr double kRate = 2;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder = weightless(settings);
    BodyDescription& disc = add_body(builder, "disc", Box{{1, 1, 1}}, 6, {kPlace, 0.2, 0}, 0.5);
    disc.angular_velocity = {0, 0, kRate};
    disc.programs.push_back(example_program("hydrodynamics", {{"inertia_z", 0.5}, {"turn_drag_z", 1.2}}));
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const double inertia = 6.0 * 2 / 12;
    const double right = kRate * std::exp(-1.2 * 2 / (inertia + 0.5));
    return {{"rate", "rad/s", right, course.last("disc").spin.z(), 0.02 * kRate}};
  };
  return scene;
}

// A wind of linear drag k: v = u (1 - exp(-k t)).
Scene is_blown_away() {
  Scene scene = program_scene("is_blown_away", 2);
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder = weightless(settings);
    add_body(builder, "leaf", Box{{0.5, 0.5, 0.1}}, 0.1, {kPlace, 0.2, 0}, 0.5)
        .programs.push_back(example_program("wind", {{"damping", 0.8}, {"x", 5}, {"y", 2}}));
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const double part = 1 - std::exp(-0.8 * 2);
    const Eigen::Vector3d velocity = course.last("leaf").velocity;
    return {{"along x", "m/s", 5 * part, velocity.x(), 0.05},
            {"along y", "m/s", 2 * part, velocity.y(), 0.02}};
  };
  return scene;
}

// Told to go ahead and to turn, it goes in a circle of v / w, although it scrapes over a plane.
Scene is_led_in_a_circle() {
  Scene scene = program_scene("is_led_in_a_circle", 8);
  static constexpr double kSpeed = 1.2;
  static constexpr double kTurn = 0.8;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder = on_plane(with_gravity(settings, {0, 0, -kGravity}), 0.4);
    add_body(builder, "slab", Box{{0.6, 0.4, 0.2}}, 5, {kPlace, 0.2, 0.1}, 0.4)
        .programs.push_back(
            example_program("velocity_control", {{"planar", 1}, {"x", kSpeed}, {"turn_z", kTurn}}));
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const Glance& last = course.last("slab");
    return {{"speed", "m/s", kSpeed, last.velocity.head<2>().norm(), 0.01 * kSpeed},
            {"rate", "rad/s", kTurn, last.spin.z(), 0.01 * kTurn}};
  };
  return scene;
}

BodyDescription& add_drone(WorldBuilder& builder, const Eigen::Vector3d& place, ProgramNumbers numbers) {
  BodyDescription& drone = add_body(builder, "drone", Box{{0.4, 0.4, 0.1}}, 1.5, place, 0.5);
  numbers.insert(numbers.end(), {{"thrust", 40}, {"torque", 2}});
  drone.programs.push_back(example_program("multicopter", numbers));
  return drone;
}

// It leans into the wind, whose drag is k (air - velocity): its thrust has to balance that and its weight.
Scene climbs_by_rotors() {
  Scene scene = program_scene("climbs_by_rotors", 12);
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    add_drone(builder, {kPlace, 0.2, 0}, {{"x", 1.5}, {"z", 0.5}})
        .programs.push_back(example_program("wind", {{"damping", 0.2}, {"y", 2}}));
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const Glance& last = course.last("drone");
    const Eigen::Vector3d drag = 0.2 * Eigen::Vector3d(-1.5, 2, -0.5);
    const double right = std::atan2(drag.head<2>().norm(), kGravity - drag.z());
    const Eigen::Vector3d up = last.turn * Eigen::Vector3d::UnitZ();
    // It keeps its rate of turn, and leaning has turned it by a hundredth.
    const Eigen::Vector3d left =
        Eigen::Vector3d::UnitZ().cross(last.turn * Eigen::Vector3d::UnitX()).normalized();
    return {{"speed", "m/s", 1.5, last.velocity.head<2>().norm(), 0.01},
            {"sideways", "m/s", 0, last.velocity.dot(left), 0.001},
            {"climb", "m/s", 0.5, last.velocity.z(), 0.01},
            {"lean", "rad", right, std::acos(up.z()), 0.002}};
  };
  return scene;
}

// Round a circle of v / w, it leans by tan(lean) = v w / g.
Scene circles_by_rotors() {
  Scene scene = program_scene("circles_by_rotors", 10);
  static constexpr double kSpeed = 1.5;
  static constexpr double kTurn = 0.5;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    add_drone(builder, {kPlace, 0.2, 0}, {{"x", kSpeed}, {"turn", kTurn}});
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const Glance& last = course.last("drone");
    const Eigen::Vector3d up = last.turn * Eigen::Vector3d::UnitZ();
    return {{"speed", "m/s", kSpeed, last.velocity.head<2>().norm(), 0.02 * kSpeed},
            {"rate", "rad/s", kTurn, last.spin.z(), 0.02 * kTurn},
            {"lean", "rad", std::atan2(kSpeed * kTurn, kGravity), std::acos(up.z()), 0.005}};
  };
  return scene;
}

}  // namespace

std::vector<Scene> fluid_scenes() {
  return {sinks(),
          coasts(),
          stops_turning(),
          is_blown_away(),
          is_led_in_a_circle(),
          climbs_by_rotors(),
          circles_by_rotors()};
}

}  // namespace tessera::truth
