// Triggers: the ticks in which what falls and flies enters and leaves.
#include <cmath>
#include <string>
#include <utility>

#include "experiments/truth/scene_parts.h"

namespace tessera::truth {
namespace {

constexpr double kDropHeight = 3;     // m
constexpr double kDropRadius = 0.25;  // m
constexpr double kShotSpeed = 200;    // m/s
constexpr double kShotRadius = 0.02;  // m

// Of the body "visitor" and the triggers: the first tick of a phase; 0 if there is none.
double tick_of(const Course& course, const std::string& trigger, ContactPhase phase) {
  for (const std::vector<ContactEvent>& events : course.contacts()) {
    for (const ContactEvent& event : events) {
      if (event.trigger && event.phase == phase && event.a == course.id(trigger) &&
          event.b == course.id("visitor"))
        return static_cast<double>(event.tick);
    }
  }
  return 0;
}

double beginnings_and_ends(const Course& course) {
  double sum = 0;
  for (const std::vector<ContactEvent>& events : course.contacts()) {
    for (const ContactEvent& event : events) sum += event.phase == ContactPhase::kPersist ? 0 : 1;
  }
  return sum;
}

Scene scene_of(const std::string& name) {
  Scene scene;
  scene.group = "triggers";
  scene.name = name;
  scene.in_bullet = false;
  scene.keeps_contacts = true;
  return scene;
}

// What overlaps a trigger as a tick begins is told in that tick.
double told_after(const Course& course, double seconds) { return std::ceil(seconds / course.dt()) + 1; }

// The border of sectors is within the zone, and is crossed there.
Scene falls_through() {
  Scene scene = scene_of("falls_through");
  scene.seconds = 1.5;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    builder.add("zone", builder.shape(Box{{2, 2, 1}}), 1, {kPlace, 0, 0}, Motion::kStatic)
        .properties.trigger = true;
    builder.add("visitor", builder.shape(Sphere{kDropRadius}), 1, {kPlace - 0.75, 0.1, kDropHeight})
        .linear_velocity = {1, 0, 0};
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const auto fall = [](double height) { return std::sqrt(2 * height / kGravity); };
    return {{"enters", "tick", told_after(course, fall(kDropHeight - 0.5 - kDropRadius)),
             tick_of(course, "zone", ContactPhase::kBegin), 0},
            {"leaves", "tick", told_after(course, fall(kDropHeight + 0.5 + kDropRadius)),
             tick_of(course, "zone", ContactPhase::kEnd), 0},
            {"events", "", 2, beginnings_and_ends(course), 0},
            {"velocity at the end", "m/s", -kGravity * course.seconds(), course.last("visitor").velocity.z(),
             1e-4}};
  };
  return scene;
}

// Through sheets of 1 mm, 200 m/s: each is met on the way of one tick, and left at the beginning of the next.
Scene flies_through() {
  Scene scene = scene_of("flies_through");
  scene.seconds = 0.2;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, Eigen::Vector3d::Zero()));
    const ShapeId sheet = builder.shape(Box{{1e-3, 1, 1}});
    for (const auto& [name, x] : {std::pair("first", 8.0), std::pair("second", 21.0)})
      builder.add(name, sheet, 1, {kPlace + x, 0, 0}, Motion::kStatic).properties.trigger = true;
    builder.add("visitor", builder.shape(Sphere{kShotRadius}), 0.1, {kPlace, 0.1, 0.2}).linear_velocity = {
        kShotSpeed, 0, 0};
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const auto tick = [&](double way) {
      return std::ceil((way - kShotRadius - 5e-4) / (kShotSpeed * course.dt()));
    };
    Results results = {{"events", "", 4, beginnings_and_ends(course), 0}};
    for (const auto& [name, x] : {std::pair("first", 8.0), std::pair("second", 21.0)}) {
      const double got = tick_of(course, name, ContactPhase::kBegin);
      results.push_back({std::string("enters the ") + name, "tick", tick(x), got, 0});
      results.push_back({std::string("leaves the ") + name, "tick", tick(x) + 1,
                         tick_of(course, name, ContactPhase::kEnd), 0});
    }
    return results;
  };
  return scene;
}

}  // namespace

std::vector<Scene> trigger_scenes() { return {falls_through(), flies_through()}; }

}  // namespace tessera::truth
