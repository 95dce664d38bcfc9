// What slides goes straight, and as far as its energy leads; what rides on a carrier stays on its place.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "experiments/truth/scene_parts.h"

namespace tessera::truth {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

// --- slides ---

constexpr double kSlideFriction = 0.3;
constexpr double kSlideSpeed = 6;  // m/s

Scene slide_of(const std::string& name, const Vector3d& size, double yaw, double direction) {
  Scene scene;
  scene.group = "slide";
  scene.name = name;
  scene.seconds = 3;
  scene.has_order = true;
  const Vector3d along(std::cos(direction), std::sin(direction), 0);
  scene.world = [=](const WorldSettings& settings) {
    WorldBuilder builder = on_plane(settings, kSlideFriction);
    BodyDescription& body =
        add_body(builder, "body", Box{size}, 10, {kPlace, 0, size.z() / 2}, kSlideFriction);
    body.pose.orientation = Eigen::AngleAxisd(yaw, Vector3d::UnitZ());
    body.linear_velocity = kSlideSpeed * along;
    return builder.world();
  };
  scene.results = [=](const Course& course) -> Results {
    const Vector3d way = course.last("body").place - course.first("body").place;
    const double right = kSlideSpeed * kSlideSpeed / (2 * kSlideFriction * kGravity);
    const double aside = std::atan2(along.cross(way).z(), along.dot(way));
    return {{"direction", "degrees", 0, aside * 180 / pi, 0.1},
            {"way", "m", right, way.norm(), 0.005 * right},
            {"speed at the end", "m/s", 0, course.last("body").velocity.norm(), 1e-3}};
  };
  return scene;
}

// A box that slides and turns at once. Its corners are at R from its centre, m R^2 = 3 I, and both speeds go
// down by d(v, R w) = -mu g (v, 3 R w) / |(v, R w)| dt: with u = v / v0, R w = R w0 u^3, and both end at
// once.
Scene slide_that_turns(const std::string& name, double rate) {
  constexpr int kSteps = 1000;
  const Vector3d size(0.8, 0.6, 0.05);
  const double radius = size.head<2>().norm() / 2;
  Scene scene;
  scene.group = "slide";
  scene.name = name;
  scene.seconds = 4;
  scene.has_order = true;
  scene.in_bullet = false;
  scene.world = [=](const WorldSettings& settings) {
    WorldBuilder builder = on_plane(settings, kSlideFriction);
    BodyDescription& body =
        add_body(builder, "body", Box{size}, 10, {kPlace, 0, size.z() / 2}, kSlideFriction);
    body.linear_velocity = {kSlideSpeed, 0, 0};
    body.angular_velocity = {0, 0, rate};
    return builder.world();
  };
  scene.results = [=](const Course& course) -> Results {
    double way = 0;
    double angle = 0;
    for (int n = 0; n < kSteps; ++n) {
      const double u = (n + 0.5) / kSteps;
      const double speed = std::hypot(kSlideSpeed * u, radius * rate * u * u * u);
      way += kSlideSpeed * speed / kSteps;
      angle += rate * u * u * speed / kSteps;
    }
    way /= kSlideFriction * kGravity;
    angle /= kSlideFriction * kGravity;
    const std::vector<Glance>& glances = course.of("body");
    double turned = 0;
    for (std::size_t n = 1; n < glances.size(); ++n) {
      const Eigen::Quaterniond step = glances[n].turn * glances[n - 1].turn.conjugate();
      turned += 2 * std::atan(step.z() / step.w());
    }
    const Vector3d went = course.last("body").place - course.first("body").place;
    return {{"direction", "degrees", 0, std::atan2(went.y(), went.x()) * 180 / pi, 0.1},
            {"way", "m", way, went.norm(), 0.005 * way},
            {"angle", "rad", angle, turned, 0.01 * angle},
            {"speed at the end", "m/s", 0, course.last("body").velocity.norm(), 1e-3}};
  };
  return scene;
}

// --- carriers ---

// Where a carrier is at a time, and how it is turned.
using Path = std::function<Pose(double time)>;

constexpr double kRideFriction = 0.5;

Scene carrier_scene(const std::string& name, const Geometry& carrier, const Path& path,
                    const Vector3d& rider) {
  Scene scene;
  scene.group = "carrier";
  scene.name = name;
  scene.seconds = 5;
  scene.in_bullet = false;
  scene.has_order = true;
  scene.world = [=](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    const Pose start = path(0);
    BodyDescription& moved =
        builder.add("carrier", builder.shape(carrier), 1, start.position, Motion::kKinematic);
    moved.properties.friction = kRideFriction;
    add_body(builder, "rider", Box{{0.2, 0.2, 0.1}}, 2, start.position + rider, kRideFriction);
    return builder.world();
  };
  scene.script = [=](const Course& course) -> std::vector<Command> {
    const Pose pose = path(static_cast<double>(course.ticks() + 1) * course.dt());
    return {move_to(course, "carrier", pose.position, pose.orientation)};
  };
  scene.results = [](const Course& course) -> Results {
    const std::vector<Glance>& carriers = course.of("carrier");
    const std::vector<Glance>& riders = course.of("rider");
    const auto place = [&](std::size_t n) -> Vector3d {
      return carriers[n].turn.conjugate() * (riders[n].place - carriers[n].place);
    };
    double slip = 0;
    for (std::size_t n = 0; n < riders.size(); ++n) slip = std::max(slip, (place(n) - place(0)).norm());
    return {{"slip", "mm", 0, slip * 1e3, 1}};
  };
  return scene;
}

Path speeds_up(const Vector3d& acceleration) {
  return [=](double time) {
    return Pose{Vector3d(kPlace, 0, -0.1) + acceleration * time * time / 2, Eigen::Quaterniond::Identity()};
  };
}

// Turns up to `speed` (rad/s) within the first 3 s, about its axis.
Path turns_up(double speed) {
  return [=](double time) {
    const double angle = time < 3 ? speed * time * time / 6 : speed * (time - 1.5);
    return Pose{Vector3d(kPlace, 0, -0.1), Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vector3d::UnitZ()))};
  };
}

// A lift: goes up by 2 m and comes to rest again, as a cosine does.
Path lifts(double period) {
  return [=](double time) {
    return Pose{Vector3d(kPlace, 0, -0.1 + 1 - std::cos(2 * pi * time / period)),
                Eigen::Quaterniond::Identity()};
  };
}

}  // namespace

std::vector<Scene> slide_scenes() {
  const double turned = pi / 4;
  std::vector<Scene> scenes = {
      slide_of("cube", {0.3, 0.3, 0.3}, 0, 0),
      slide_of("cube_turned", {0.3, 0.3, 0.3}, turned, 0),
      slide_of("plate_along", {1, 0.1, 0.1}, 0, 0),
      slide_of("plate_turned", {1, 0.1, 0.1}, turned, 0),
      slide_of("plate_across", {1, 0.1, 0.1}, pi / 2, 0),
      slide_of("plate_turned_by_20_degrees", {1, 0.1, 0.1}, pi / 9, 0),
      slide_of("tile_turned", {0.8, 0.8, 0.05}, turned, 0),
      slide_of("tile_towards_70_degrees", {0.8, 0.4, 0.05}, 0, 70 * pi / 180),
      slide_of("beam_turned", {2, 0.2, 0.2}, 60 * pi / 180, 0),
      slide_of("beam_towards_200_degrees", {2, 0.2, 0.2}, turned, 200 * pi / 180),
      slide_that_turns("tile_that_turns", 4),
      slide_that_turns("tile_that_spins", 20),
  };
  for (Scene& scene : scenes)
    scene.in_quick = scene.name == "plate_turned" || scene.name == "cube" || scene.name == "tile_that_spins";
  return scenes;
}

std::vector<Scene> carrier_scenes() {
  const Box wagon{{3, 2, 0.2}};
  const Vector3d on_top(0, 0, 0.15);
  std::vector<Scene> scenes;
  for (const double share : {0.2, 0.5, 0.8}) {
    const double acceleration = share * kRideFriction * kGravity;
    scenes.push_back(carrier_scene(absl::StrCat("wagon_at_", share, "_of_what_friction_holds"), wagon,
                                   speeds_up({acceleration, 0, 0}), on_top));
  }
  // At 1 m from the axis, omega^2 is the acceleration.
  for (const double share : {0.2, 0.5, 0.8}) {
    scenes.push_back(carrier_scene(absl::StrCat("turntable_at_", share, "_of_what_friction_holds"),
                                   Cylinder{2, 0.2}, turns_up(std::sqrt(share * kRideFriction * kGravity)),
                                   {1, 0, 0.15}));
  }
  scenes.push_back(carrier_scene("lift", wagon, lifts(2.5), on_top));
  scenes.push_back(
      carrier_scene("wagon_at_an_angle", wagon,
                    speeds_up({0.5 * kRideFriction * kGravity, 0.4 * kRideFriction * kGravity, 0}), on_top));
  return scenes;
}

}  // namespace tessera::truth
