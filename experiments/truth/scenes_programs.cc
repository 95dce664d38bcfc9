// Programs: lifts, characters and vehicles against the formulas for how they move.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "experiments/truth/scene_parts.h"
#include "lpss/simulation/example_programs.h"

namespace tessera::truth {
namespace {

// Of the first program of a body, at the beginning of a tick.
Command tell(const Course& course, const std::string& body, absl::string_view kind,
             const ProgramNumbers& inputs) {
  TellProgram told{course.id(body), 0, {}, {}};
  for (const auto& [name, value] : inputs)
    told.inputs.emplace_back(place_of(name, find_program(kind)->inputs()).value(), value);
  return told;
}

// At `seconds`, once.
Script telling(double seconds, const std::string& body, absl::string_view kind,
               const ProgramNumbers& inputs) {
  return [=](const Course& course) -> std::vector<Command> {
    if (course.ticks() != static_cast<Tick>(std::lround(seconds / course.dt()))) return {};
    return {tell(course, body, kind, inputs)};
  };
}

// m, of a car.
const Eigen::Vector3d kRoad(kPlace - 3, 0.2, 0.6);

// Speeds up and brakes evenly: d / v + v / a.
Scene lift() {
  Scene scene = program_scene("lift");
  scene.seconds = 8;
  static constexpr double kWay = 6;
  static constexpr double kSpeed = 2;
  static constexpr double kAcceleration = 1;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    builder.add("lift", builder.shape(Box{{2, 2, 0.2}}), 1, {kPlace, 0, 0}, Motion::kKinematic)
        .programs.push_back(
            example_program("mover", {{"z", kWay}, {"speed", kSpeed}, {"acceleration", kAcceleration}}));
    return builder.world();
  };
  scene.script = telling(1, "lift", "mover", {{"goal", 1}});
  scene.results = [](const Course& course) -> Results {
    const std::vector<Glance>& course_of = course.of("lift");
    const auto arrived =
        std::ranges::find_if(course_of, [](const Glance& g) { return g.place.z() > kWay - 1e-6; });
    double fastest = 0;
    for (const Glance& glance : course_of) fastest = std::max(fastest, glance.velocity.norm());
    return {{"arrives", "s", 1 + kWay / kSpeed + kSpeed / kAcceleration,
             static_cast<double>(arrived - course_of.begin()) * course.dt(), 3 * course.dt()},
            {"end of the way", "m", kWay, course.last("lift").place.z(), 1e-6},
            {"largest speed", "m/s", kSpeed, fastest, 1e-3}};
  };
  return scene;
}

Scene walks() {
  Scene scene = program_scene("walks");
  scene.seconds = 7;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder = on_plane(with_gravity(settings, {0, 0, -kGravity}), 0.5);
    add_character(builder, "walker", {kPlace - 4, 0.2, kExampleStanding});
    return builder.world();
  };
  scene.script = telling(1, "walker", "character", {{"x", 1.5}});
  scene.results = [](const Course& course) -> Results {
    return {{"way", "m", 1.5 * 4, course.at("walker", 6).place.x() - course.at("walker", 2).place.x(), 1e-3},
            {"height", "m", kExampleStanding, course.last("walker").place.z(), 1e-3},
            {"speed", "m/s", 1.5, course.last("walker").velocity.norm(), 1e-4}};
  };
  return scene;
}

Scene stands_on_slope(double degrees) {
  Scene scene = program_scene("stands_on_slope_" + std::to_string(std::lround(degrees)));
  scene.seconds = 60;
  scene.quick_seconds = 10;
  const double slope = degrees * EIGEN_PI / 180;
  scene.world = [slope](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    BodyDescription& ground =
        builder.add("slope", builder.shape(Box{{40, 40, 2}}), 1, {kPlace, 0, 0}, Motion::kStatic);
    ground.pose.orientation = Eigen::AngleAxisd(-slope, Eigen::Vector3d::UnitY());
    ground.pose.position.local += ground.pose.orientation * Eigen::Vector3d(0, 0, -1);
    add_character(builder, "walker", {kPlace + 0.1, 0.2, kExampleStanding + 0.1 * std::tan(slope)});
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    return {{"creep after the first second", "m", 0, way(course, "walker", 1), 1e-4}};
  };
  return scene;
}

Scene jumps() {
  Scene scene = program_scene("jumps");
  scene.seconds = 3;
  scene.has_order = true;
  static constexpr double kJumpHeight = 0.8;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder = on_plane(with_gravity(settings, {0, 0, -kGravity}), 0.5);
    add_character(builder, "walker", {kPlace, 0.2, kExampleStanding}, {{"jump_height", kJumpHeight}});
    return builder.world();
  };
  scene.script = telling(1, "walker", "character", {{"jump", 1}});
  scene.results = [](const Course& course) -> Results {
    double highest = 0;
    for (const Glance& glance : course.of("walker")) highest = std::max(highest, glance.place.z());
    // It leaves the ground within a tick, in which it rises as fast as it does after it.
    const double rise = std::sqrt(2 * kGravity * kJumpHeight);
    return {{"highest", "m", kExampleStanding + kJumpHeight, highest, rise * course.dt()}};
  };
  return scene;
}

// It pushes off from a raft that floats freely: their momenta are opposite.
Scene pushes_off() {
  Scene scene = program_scene("pushes_off");
  scene.seconds = 3;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    BodyDescription& raft = add_body(builder, "raft", Box{{6, 4, 0.5}}, 400, {kPlace, 0, -0.25}, 0.5);
    raft.properties.gravity = false;
    raft.properties.inertia = {1e9, 1e9, 1e9};
    add_character(builder, "walker", {kPlace - 2, 0, kExampleStanding}).properties.gravity = false;
    return builder.world();
  };
  scene.script = telling(1, "walker", "character", {{"x", 1}});
  scene.results = [](const Course& course) -> Results {
    const double walker = 80 * course.last("walker").velocity.x();
    const double raft = 400 * course.last("raft").velocity.x();
    return {{"momentum", "kg m/s", 0, walker + raft, 0.05},
            {"momentum of the walker", "kg m/s", 80 * 400.0 / 480, walker, 0.5}};
  };
  return scene;
}

Scene brakes(double grip) {
  Scene scene = program_scene("brakes_with_grip_" + std::to_string(std::lround(100 * grip)));
  scene.seconds = 8;
  scene.has_border = true;
  scene.world = [grip](const WorldSettings& settings) {
    WorldBuilder builder = on_plane(with_gravity(settings, {0, 0, -kGravity}), 0.5);
    add_car(builder, "car", kRoad, {{"grip", grip}, {"brake_force", 1e5}, {"rolling", 0}}).linear_velocity = {
        15, 0, 0};
    return builder.world();
  };
  scene.script = telling(1, "car", "vehicle", {{"brake", 1}});
  scene.results = [grip](const Course& course) -> Results {
    const Glance& begin = course.at("car", 1);
    const double speed = begin.velocity.x();
    const double right = speed * speed / (2 * grip * kGravity);
    const double got = course.last("car").place.x() - begin.place.x();
    // It brakes a tick after it is told.
    return {{"braking way", "m", right, got, 0.02 * right + speed * course.dt()},
            {"speed at the end", "m/s", 0, course.last("car").velocity.norm(), 1e-4}};
  };
  return scene;
}

Scene circles() {
  Scene scene = program_scene("circles");
  scene.seconds = 20;
  static constexpr double kAngle = 0.2;  // rad
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder = on_plane(with_gravity(settings, {0, 0, -kGravity}), 0.5);
    add_car(builder, "car", kRoad, {{"throttle", 0.05}, {"speed", 2}, {"steer_angle", kAngle}, {"steer", 1}});
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const Glance& end = course.last("car");
    // Slow, it rolls about a point beside its rear axle.
    const double middle = end.velocity.norm() / end.spin.z();
    const double right = std::hypot(2.6 / std::tan(kAngle), 2.6 / 2);
    return {{"radius", "m", right, middle, 0.01 * right}};
  };
  return scene;
}

Scene parks_on_slope() {
  Scene scene = program_scene("parks_on_slope");
  scene.seconds = 60;
  scene.quick_seconds = 10;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder = on_slope(settings, 20 * EIGEN_PI / 180, 0.5);
    add_car(builder, "car", kRoad, {{"brake", 1}});
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    return {{"creep after two seconds", "m", 0, way(course, "car", 2), 1e-4}};
  };
  return scene;
}

// T = 2 pi sqrt(m / (density g area)), about the depth that its weight displaces.
Scene swings_in_water() {
  Scene scene = program_scene("swings_in_water");
  scene.seconds = 20;
  static constexpr double kMass = 600;  // kg, of a cube of 1 m^3
  static constexpr double kDeep = 0.2;  // m, that it begins too deep
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    add_body(builder, "buoy", Box{{1, 1, 1}}, kMass, {kPlace, 0.2, 0}, 0.5)
        .programs.push_back(
            example_program("floater", {{"level", kMass / 1000 - 0.5 + kDeep}, {"damping", 0}, {"drag", 0}}));
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const std::vector<Glance>& all = course.of("buoy");
    std::vector<double> crossed;
    double highest = 0;
    for (std::size_t n = 1; n < all.size(); ++n) {
      const double before = all[n - 1].place.z() - kDeep;
      const double now = all[n].place.z() - kDeep;
      highest = std::max(highest, now);
      if (before < 0 && now >= 0)
        crossed.push_back((static_cast<double>(n) - now / (now - before)) * course.dt());
    }
    const double periods = static_cast<double>(crossed.size()) - 1;
    const double got = periods > 0 ? (crossed.back() - crossed.front()) / periods : 0;
    const double right = 2 * EIGEN_PI * std::sqrt(kMass / (1000 * kGravity));
    return {{"period", "s", right, got, 0.01 * right}, {"highest", "m", kDeep, highest, 0.1 * kDeep}};
  };
  return scene;
}

// It leans by what it bears to the side: sin(lean) = v^2 tan(angle) / (g wheelbase).
Scene leans() {
  Scene scene = program_scene("leans");
  scene.seconds = 8;
  static constexpr double kAngle = 0.1;  // rad, of its front wheel
  static constexpr double kSpeed = 8;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder = on_plane(with_gravity(settings, {0, 0, -kGravity}), 0.5);
    BodyDescription& bike = add_body(builder, "bike", Box{{1.6, 0.3, 0.5}}, 200, {kPlace, 0.2, 0.6}, 0.5);
    bike.linear_velocity = {kSpeed, 0, 0};
    bike.programs.push_back(example_program(
        "motorcycle", {{"throttle", 1}, {"speed", kSpeed}, {"steer_angle", kAngle}, {"steer", 1}}));
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const Glance& last = course.last("bike");
    const double speed = last.velocity.norm();
    const double lean = std::asin(speed * speed * std::tan(kAngle) / (kGravity * 1.4));
    const double got = std::asin(-(last.turn * Eigen::Vector3d::UnitY()).z());
    const double rate = kGravity * std::tan(lean) / speed;
    return {{"lean", "rad", lean, got, 0.02 * lean}, {"rate", "rad/s", rate, last.spin.z(), 0.03 * rate}};
  };
  return scene;
}

}  // namespace

std::vector<Scene> program_scenes() {
  return {swings_in_water(), lift(),      walks(),     stands_on_slope(15), stands_on_slope(40), jumps(),
          pushes_off(),      brakes(0.5), brakes(0.9), circles(),           parks_on_slope(),    leans()};
}

}  // namespace tessera::truth
