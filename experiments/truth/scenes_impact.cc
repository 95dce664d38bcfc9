// Rebounds: velocities after them, and no energy that was not there before.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "experiments/truth/scene_parts.h"

namespace tessera::truth {
namespace {

using Eigen::Vector3d;

constexpr double kShare = 0.01;       // of a velocity
constexpr double kEnergyGain = 1e-3;  // of the energy at the start: rounding of places, and of a step

Result gained(const Course& course) {
  return {"largest gain of energy", "of that at the start", 0, energy_gain(course), kEnergyGain};
}

// m/s, along z: the first that points up.
double speed_up(const Course& course, const std::string& body) {
  for (const Glance& glance : course.of(body)) {
    if (glance.velocity.z() > 0) return glance.velocity.z();
  }
  return 0;
}

// The height (m) to which the body comes back the first time.
double first_apex(const Course& course, const std::string& body) {
  const std::vector<Glance>& glances = course.of(body);
  for (std::size_t n = 1; n + 1 < glances.size(); ++n) {
    const double height = glances[n].place.z();
    if (glances[n - 1].place.z() < height && glances[n + 1].place.z() <= height) return height;
  }
  return -1;
}

// Falls by `height` (m) onto a plane, or a pedestal narrower than itself, of a restitution of 1. What comes
// back is measured by how high it gets: at the velocity with which it leaves.
Scene drop(const std::string& name, const Geometry& geometry, double radius, double restitution,
           double gravity, double height, bool on_pedestal) {
  Scene scene;
  scene.group = "impact";
  scene.name = name;
  const double ground = on_pedestal ? 1 : 0;
  const double fall = std::sqrt(2 * height / gravity);  // s
  scene.seconds = fall * (1 + 1.5 * restitution);
  scene.has_order = gravity == kGravity;
  scene.world = [=](const WorldSettings& settings) {
    WorldBuilder builder = on_plane(settings, 0.5, 1);
    builder.world().settings.gravity = UniformGravity{{0, 0, -gravity}};
    if (on_pedestal) {
      BodyDescription& pedestal =
          builder.add("pedestal", builder.shape(Box{{0.75, 0.75, 1}}), 1, {kPlace, 0, 0.5}, Motion::kStatic);
      pedestal.properties.restitution = 1;
    }
    add_body(builder, "body", geometry, 2, {kPlace, 0, ground + radius + height}, 0.5, restitution);
    return builder.world();
  };
  scene.results = [=](const Course& course) -> Results {
    const double back = first_apex(course, "body") - ground - radius;
    const double right = restitution * std::sqrt(2 * gravity * height);
    double turn = 0;
    for (const Glance& glance : course.of("body")) turn = std::max(turn, glance.spin.norm());
    return {{"velocity after", "m/s", right, std::sqrt(2 * gravity * std::max(back, 0.0)), kShare * right},
            {"largest spin", "rad/s", 0, turn, 0.01},
            gained(course)};
  };
  return scene;
}

// A ball of 0.1 m hits a plane at a slant, without gravity.
Scene oblique(const std::string& name, double friction, double restitution, double vx_right,
              double spin_right) {
  Scene scene;
  scene.group = "impact";
  scene.name = name;
  scene.seconds = 0.25;
  scene.world = [=](const WorldSettings& settings) {
    WorldBuilder builder = on_plane(with_gravity(settings, Vector3d::Zero()), friction, 1);
    builder.world().settings.gravity = UniformGravity{Vector3d::Zero()};
    add_body(builder, "ball", Sphere{0.1}, 1, {kPlace - 0.3, 0, 0.45}, friction, restitution)
        .linear_velocity = {5, 0, -4};
    return builder.world();
  };
  scene.results = [=](const Course& course) -> Results {
    const Glance& ball = course.last("ball");
    return {{"velocity along", "m/s", vx_right, ball.velocity.x(), kShare * vx_right},
            {"velocity away", "m/s", 4 * restitution, speed_up(course, "ball"), kShare * 4 * restitution},
            {"spin", "rad/s", spin_right, ball.spin.y(), kShare * spin_right},
            gained(course)};
  };
  return scene;
}

// One ball against two that touch, all alike, without friction.
Scene cue_scene() {
  Scene scene;
  scene.group = "impact";
  scene.name = "cue_at_two";
  scene.seconds = 1;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, Vector3d::Zero()));
    add_body(builder, "cue", Sphere{0.1}, 1, {kPlace - 1, 0, 0}, 0, 1).linear_velocity = {2, 0, 0};
    add_body(builder, "a", Sphere{0.1}, 1, {kPlace, 0.1, 0}, 0, 1);
    add_body(builder, "b", Sphere{0.1}, 1, {kPlace, -0.1, 0}, 0, 1);
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const Vector3d cue = course.last("cue").velocity, a = course.last("a").velocity,
                   b = course.last("b").velocity;
    const double across = 1.2 / std::sqrt(3);
    return {
        {"velocity of the cue", "m/s", -0.4, cue.x(), 0.012},
        {"velocity of a along x", "m/s", 1.2, a.x(), 0.012},
        {"velocity of a along y", "m/s", across, a.y(), 0.012},
        {"velocity of b along y", "m/s", -across, b.y(), 0.012},
        {"difference of mirrored velocities", "m/s", 0, (a - Vector3d(b.x(), -b.y(), b.z())).norm(), 1e-5},
        gained(course)};
  };
  return scene;
}

// Two balls meet head on.
Scene head_on(double mass, double restitution) {
  Scene scene;
  scene.group = "impact";
  scene.name = absl::StrCat("head_on_1:", mass, "_e_", restitution);
  scene.seconds = 1;
  scene.world = [=](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, Vector3d::Zero()));
    // The restitutions of a contact are multiplied.
    add_body(builder, "a", Sphere{0.1}, 1, {kPlace - 0.713, 0, 0}, 0, restitution).linear_velocity = {2, 0,
                                                                                                      0};
    add_body(builder, "b", Sphere{0.1}, mass, {kPlace, 0, 0}, 0, 1);
    return builder.world();
  };
  scene.results = [=](const Course& course) -> Results {
    const double a = 2 * (1 - mass * restitution) / (1 + mass);
    const double b = 2 * (1 + restitution) / (1 + mass);
    const double momentum = course.last("a").velocity.x() + mass * course.last("b").velocity.x();
    return {{"velocity of a", "m/s", a, course.last("a").velocity.x(), kShare * 2},
            {"velocity of b", "m/s", b, course.last("b").velocity.x(), kShare * b},
            {"momentum", "kg m/s", 2, momentum, 2e-5},
            gained(course)};
  };
  return scene;
}

}  // namespace

std::vector<Scene> impact_scenes() {
  const Box box{{1, 1, 1}};
  std::vector<Scene> scenes = {
      drop("box_flat_e_1", box, 0.5, 1, kGravity, 1, false),
      drop("box_flat_e_0.5", box, 0.5, 0.5, kGravity, 1, false),
      drop("box_on_pedestal_e_1", box, 0.5, 1, kGravity, 1, true),
      drop("box_on_pedestal_e_0.5", box, 0.5, 0.5, kGravity, 1, true),
      drop("ball_e_1", Sphere{0.1}, 0.1, 1, kGravity, 1, false),
      drop("ball_e_0.8", Sphere{0.1}, 0.1, 0.8, kGravity, 1, false),
      drop("ball_in_low_gravity", Sphere{0.1}, 0.1, 0.9, 0.009, 1, false),
      drop("box_in_low_gravity", box, 0.5, 0.5, 0.009, 1, false),
      // It slides all the time: mu (1 + e) 4 m/s are less than two sevenths of 5 m/s.
      oblique("ball_slants_and_slides", 0.1, 0.8, 5 - 0.1 * 1.8 * 4, 2.5 * 0.1 * 1.8 * 4 / 0.1),
      oblique("ball_slants_and_rolls", 0.2, 0.8, 25.0 / 7, 250.0 / 7),
      cue_scene(),
  };
  for (const double mass : {1.0, 10.0}) {
    for (const double restitution : {1.0, 0.5}) scenes.push_back(head_on(mass, restitution));
  }
  return scenes;
}

}  // namespace tessera::truth
