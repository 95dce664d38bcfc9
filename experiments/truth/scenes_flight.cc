// Bodies that touch nothing: falls and orbits as closed forms have them, and what is conserved.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "experiments/truth/scene_parts.h"

namespace tessera::truth {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

// --- falls ---

Scene fall() {
  Scene scene;
  scene.group = "flight";
  scene.name = "fall";
  scene.seconds = 2;
  scene.has_order = true;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    add_body(builder, "ball", Sphere{0.1}, 1, {kPlace, 0, 0}, 0).linear_velocity = {1, 0, 3};
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const double time = course.seconds();
    const Vector3d right(kPlace + time, 0, 3 * time - kGravity * time * time / 2);
    const Glance& ball = course.last("ball");
    return {{"place", "m", 0, (ball.place - right).norm(), 0.005 * std::abs(right.z())},
            {"velocity", "m/s", 3 - kGravity * time, ball.velocity.z(), 1e-4}};
  };
  return scene;
}

// --- forces that last ---

// One along the world's axes, and one that turns with its body, at w: v = F / (m w) (sin wt, 1 - cos wt).
Scene thrusters() {
  constexpr double kPush = 6, kMass = 3, kTurn = 2;  // N, kg, rad/s
  Scene scene;
  scene.group = "flight";
  scene.name = "thrusters";
  scene.seconds = 4;
  scene.has_order = true;
  scene.in_bullet = false;
  scene.world = [=](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, Vector3d::Zero()));
    const LastingForce push{{{kPush, 0, 0}, {}}};
    add_body(builder, "straight", Sphere{0.1}, kMass, {kPlace, 0, 0}, 0).properties.lasting = push;
    BodyDescription& turning = add_body(builder, "turning", Sphere{0.1}, kMass, {kPlace, 2, 0}, 0);
    turning.angular_velocity = {0, 0, kTurn};
    turning.properties.lasting = LastingForce{push.wrench, true};
    return builder.world();
  };
  scene.results = [=](const Course& course) -> Results {
    const double time = course.seconds(), angle = kTurn * time;
    const Vector3d right = kPush / (kMass * kTurn) * Vector3d(std::sin(angle), 1 - std::cos(angle), 0);
    return {{"momentum given", "N s", kPush * time, kMass * course.last("straight").velocity.x(), 1e-3},
            {"velocity of one that turns", "m/s", 0, (course.last("turning").velocity - right).norm(), 1e-3}};
  };
  return scene;
}

// --- orbits ---

constexpr double kEarthRadius = 6.371e6;  // m
constexpr double kHeight = 4e5;           // m

Scene orbit(const std::string& name, double seconds, double inclination) {
  Scene scene;
  scene.group = "orbit";
  scene.name = name;
  scene.seconds = seconds;
  scene.quick_seconds = 600;
  scene.every = 600;
  scene.in_bullet = false;
  scene.has_border = false;
  const double radius = kEarthRadius + kHeight;
  const double speed = std::sqrt(kGravity * kEarthRadius * kEarthRadius / radius);
  const Vector3d across(0, std::cos(inclination), std::sin(inclination));
  scene.world = [=](const WorldSettings& given) {
    WorldSettings settings = given;
    settings.gravity = CentralGravity{{}, kGravity, kEarthRadius};
    settings.sleep_after = 0;
    WorldBuilder builder(settings);
    add_body(builder, "satellite", Sphere{0.5}, 100, {radius, 0, 0}, 0).linear_velocity = speed * across;
    return builder.world();
  };
  scene.results = [=](const Course& course) -> Results {
    double off_radius = 0, off_place = 0;
    const std::vector<Glance>& glances = course.of("satellite");
    for (std::size_t n = 0; n < glances.size(); ++n) {
      const double angle = speed / radius * static_cast<double>(n * 600) * course.dt();
      const Vector3d right = radius * (std::cos(angle) * Vector3d::UnitX() + std::sin(angle) * across);
      off_radius = std::max(off_radius, std::abs(glances[n].place.norm() - radius));
      off_place = std::max(off_place, (glances[n].place - right).norm());
    }
    return {{"largest error of the radius", "m", 0, off_radius, 0.1},
            {"largest error of the place", "m", 0, off_place, 10}};
  };
  return scene;
}

// --- what is conserved ---

Vector3d angular_momentum_of(const Course& course, const std::string& body, const Glance& glance) {
  const BodyProperties& properties = course.world().bodies[course.id(body).value - 1].properties;
  const Vector3d spin = glance.turn.conjugate() * glance.spin;
  return glance.turn * Vector3d(properties.inertia.data()).cwiseProduct(spin);
}

// A body with three different moments that spins about the middle one, and turns over.
Scene tumble() {
  Scene scene;
  scene.group = "conserved";
  scene.name = "tumbling_box";
  scene.seconds = 20;
  scene.quick_seconds = 5;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, Vector3d::Zero()));
    add_body(builder, "box", Box{{1, 0.4, 0.15}}, 3, {kPlace, 0, 0}, 0.5).angular_velocity = {0.02, 6, 0.01};
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const Vector3d start = angular_momentum_of(course, "box", course.first("box"));
    const double energy_at_start = energy(course, 0);
    double drift = 0, energy_drift = 0;
    for (std::size_t n = 0; n < course.of("box").size(); ++n) {
      drift = std::max(drift, (angular_momentum_of(course, "box", course.of("box")[n]) - start).norm());
      energy_drift = std::max(energy_drift, std::abs(energy(course, n) / energy_at_start - 1));
    }
    return {{"largest drift of angular momentum", "of its size", 0, drift / start.norm(), 1e-3},
            {"largest drift of energy", "of it", 0, energy_drift, 1e-3}};
  };
  return scene;
}

// Boxes that tumble into each other, with friction, without gravity: momentum about any point stays.
Scene crash() {
  constexpr int kBoxes = 6;
  Scene scene;
  scene.group = "conserved";
  scene.name = "boxes_that_collide";
  scene.seconds = 5;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, Vector3d::Zero()));
    const Vector3d spin(1, -2, 3);
    for (int n = 0; n < kBoxes; ++n) {
      const double angle = 2 * pi * n / kBoxes;
      const Vector3d out(std::cos(angle), std::sin(angle), 0.1 * n);
      BodyDescription& box = add_body(builder, absl::StrCat("box", n), Box{{0.5, 0.4, 0.3}}, 1 + n,
                                      Vector3d(kPlace, 0, 0) + 2 * out, 0.5, 0.5);
      box.linear_velocity = -1.5 * out;
      box.angular_velocity = spin * (n % 2 == 0 ? 1 : -1);
    }
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const auto sums = [&](std::size_t sample) {
      std::pair<Vector3d, Vector3d> sum(Vector3d::Zero(), Vector3d::Zero());
      for (const BodyDescription& body : course.world().bodies) {
        const Glance& glance = course.of(body.name)[sample];
        const Vector3d momentum = body.properties.mass * glance.velocity;
        sum.first += momentum;
        sum.second += (glance.place - Vector3d(kPlace, 0, 0)).cross(momentum) +
                      angular_momentum_of(course, body.name, glance);
      }
      return sum;
    };
    const auto start = sums(0);
    double drift = 0, angular_drift = 0, scale = 0;
    for (const BodyDescription& body : course.world().bodies)
      scale += body.properties.mass * course.first(body.name).velocity.norm();
    for (std::size_t n = 0; n < course.of("box0").size(); ++n) {
      drift = std::max(drift, (sums(n).first - start.first).norm());
      angular_drift = std::max(angular_drift, (sums(n).second - start.second).norm());
    }
    return {{"largest drift of momentum", "of the sizes of all", 0, drift / scale, 1e-5},
            {"largest drift of angular momentum", "of the same times 1 m", 0, angular_drift / scale, 1e-2},
            {"largest gain of energy", "of that at the start", 0, energy_gain(course), 1e-3}};
  };
  return scene;
}

}  // namespace

std::vector<Scene> flight_scenes() {
  return {fall(),
          thrusters(),
          orbit("a_day_at_400_km", 86'400, 0),
          orbit("an_hour_at_400_km_inclined", 3'600, 0.9),
          tumble(),
          crash()};
}

}  // namespace tessera::truth
