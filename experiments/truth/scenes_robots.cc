// Programs that drive joints: controllers against the formulas for what they control, robots on wheels.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "experiments/truth/scene_parts.h"
#include "lpss/simulation/example_robots.h"

namespace tessera::truth {
namespace {

// kg m^2, of a rotor on a vertical axle in the world.
constexpr double kInertia = 0.5;

WorldDescription rotor_world(const WorldSettings& settings, absl::string_view kind, ProgramNumbers numbers) {
  WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
  BodyDescription& rotor = add_body(builder, "rotor", Box{{1, 0.2, 0.2}}, 2, {kPlace, 0.2, 1}, 0.5);
  rotor.properties.inertia = {0.1, kInertia, kInertia};
  numbers.emplace_back("joint", 1);
  rotor.programs.push_back(example_program(kind, numbers));
  builder.tie("axle", JointType::kRevolute, "", "rotor", {kPlace, 0.2, 1}, Eigen::Vector3d::UnitZ());
  return builder.world();
}

double angle_of(const Glance& glance) {
  const Eigen::Vector3d x = glance.turn * Eigen::Vector3d::UnitX();
  return std::atan2(x.y(), x.x());
}

// I x'' = p (goal - x) - d x': the first overshoot is e^(-pi decay / rate) of the step, pi / rate after it.
Scene step_response() {
  Scene scene = program_scene("step_response", 6);
  scene.has_order = true;
  static constexpr double kStiffness = 8;
  static constexpr double kDamping = 0.8;
  static constexpr double kGoal = 0.8;
  scene.world = [](const WorldSettings& settings) {
    return rotor_world(settings, "pid", {{"p", kStiffness}, {"d", kDamping}, {"set_point", kGoal}});
  };
  scene.results = [](const Course& course) -> Results {
    const double decay = kDamping / (2 * kInertia);
    const double rate = std::sqrt(kStiffness / kInertia - decay * decay);
    const std::vector<Glance>& all = course.of("rotor");
    const auto highest = std::ranges::max_element(all, {}, angle_of);
    const double overshoot = kGoal * std::exp(-EIGEN_PI * decay / rate);
    // The effort of a tick follows from its beginning, which takes stiffness dt / 2 from the damping.
    const double late = kStiffness * course.dt() / 2 / kDamping;
    return {{"overshoot", "rad", overshoot, angle_of(*highest) - kGoal, 1.3 * late * overshoot},
            {"time of the overshoot", "s", EIGEN_PI / rate,
             static_cast<double>(highest - all.begin()) * course.dt(), 3 * course.dt()}};
  };
  return scene;
}

// Gains for a much finer step: what p alone holds is off by m g / p.
Scene holds_by_stiff_gains() {
  Scene scene = program_scene("holds_by_stiff_gains", 4);
  static constexpr double kStiffness = 2e5;  // N/m, with 1 kg: 2 pi / 70 ticks
  static constexpr double kMass = 1;         // kg
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    add_body(builder, "slide", Box{{0.2, 0.2, 0.2}}, kMass, {kPlace, 0.2, 1}, 0.5)
        .programs.push_back(example_program(
            "pid", {{"joint", 1}, {"p", kStiffness}, {"d", 500}, {"set_point", 0.25}, {"implicit", 1}}));
    builder.tie("rail", JointType::kPrismatic, "", "slide", {kPlace, 0.2, 1}, Eigen::Vector3d::UnitZ());
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    return {{"off its set point", "m", -kMass * kGravity / kStiffness, course.last("slide").place.z() - 1.25,
             1e-5}};
  };
  return scene;
}

// A level arm that an integral holds against its weight.
Scene holds_a_load() {
  Scene scene = program_scene("holds_a_load", 15);
  static constexpr double kGoal = -0.4;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    add_body(builder, "arm", Box{{1, 0.1, 0.1}}, 1, {kPlace, 0.2, 1}, 0.5)
        .programs.push_back(
            example_program("pid", {{"joint", 1}, {"p", 40}, {"i", 40}, {"d", 8}, {"set_point", kGoal}}));
    builder.tie("shoulder", JointType::kRevolute, "", "arm", {kPlace - 0.5, 0.2, 1},
                Eigen::Vector3d::UnitY());
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const Eigen::Vector3d x = course.last("arm").turn * Eigen::Vector3d::UnitX();
    return {{"angle", "rad", kGoal, -std::asin(x.z()), 1e-4}};
  };
  return scene;
}

// d / v + v / a.
Scene trapezoid() {
  Scene scene = program_scene("trapezoid", 5);
  static constexpr double kGoal = 2.5;
  static constexpr double kSpeed = 1.5;
  static constexpr double kAcceleration = 2;
  scene.world = [](const WorldSettings& settings) {
    return rotor_world(settings, "trajectory",
                       {{"speed", kSpeed}, {"acceleration", kAcceleration}, {"goal", kGoal}});
  };
  scene.results = [](const Course& course) -> Results {
    const std::vector<Glance>& all = course.of("rotor");
    const auto arrived = std::ranges::find_if(
        all, [](const Glance& glance) { return std::abs(angle_of(glance) - kGoal) < 1e-5; });
    double fastest = 0;
    for (const Glance& glance : all) fastest = std::max(fastest, glance.spin.norm());
    return {{"arrives", "s", kGoal / kSpeed + kSpeed / kAcceleration,
             static_cast<double>(arrived - all.begin()) * course.dt(), 3 * course.dt()},
            {"end of the way", "rad", kGoal, angle_of(course.last("rotor")), 1e-5},
            {"largest rate", "rad/s", kSpeed, fastest, 1e-4 * kSpeed}};
  };
  return scene;
}

// m, of the circle on which a point of a body moves.
double radius_of(const Glance& glance, const Eigen::Vector3d& point) {
  const Eigen::Vector3d velocity = glance.velocity + glance.spin.cross(glance.turn * point);
  return velocity.head<2>().norm() / glance.spin.z();
}

Scene turns_on_two_wheels(Tread tread) {
  Scene scene = program_scene(tread == Tread::kBall ? "two_balls" : "two_wheels", 10);
  static constexpr double kSpeed = 0.8;
  static constexpr double kTurn = 0.8;
  scene.world = [tread](const WorldSettings& settings) {
    WorldBuilder builder = on_plane(with_gravity(settings, {0, 0, -kGravity}), 1);
    add_robot(builder, "robot", tread, {kPlace, 0.2, 0}, {{"speed", kSpeed}, {"turn", kTurn}});
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const Glance& end = course.last("robot");
    return {{"radius", "m", kSpeed / kTurn, radius_of(end, {0, 0, 0}), 0.01},
            {"speed", "m/s", kSpeed, end.velocity.norm(), 0.01 * kSpeed}};
  };
  return scene;
}

Scene steers(Tread tread) {
  Scene scene = program_scene(tread == Tread::kBall ? "steers_balls" : "steers_wheels", 10);
  static constexpr double kSteer = 0.4;
  scene.world = [tread](const WorldSettings& settings) {
    WorldBuilder builder = on_plane(with_gravity(settings, {0, 0, -kGravity}), 1);
    add_rover(builder, "rover", tread, {kPlace, 0.2, 0}, {{"speed", 1}, {"steer", kSteer}});
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const Glance& end = course.last("rover");
    const double right = kExampleRover.wheelbase / std::tan(kSteer);
    const auto steered = [&](const std::string& knuckle) -> double {
      return std::remainder(angle_of(course.last(knuckle)) - angle_of(end), 2 * EIGEN_PI);
    };
    const auto expected = [&](double y) { return std::atan(kExampleRover.wheelbase / (right - y)); };
    const double y = kExampleRover.track / 2;
    return {{"radius", "m", right, radius_of(end, {-kExampleRover.wheelbase / 2, 0, 0}), 0.01 * right},
            {"angle of the inner wheel", "rad", expected(y), steered("rover_left_knuckle"), 1e-3},
            {"angle of the outer wheel", "rad", expected(-y), steered("rover_right_knuckle"), 1e-3}};
  };
  return scene;
}

Scene joint_scene(const std::string& name, double seconds) {
  return scene_without_bullet("joints", name, seconds);
}

// m g = (m + armature) a
Scene falls_with_a_motor() {
  Scene scene = joint_scene("falls_with_a_motor", 1);
  static constexpr double kArmature = 3;  // kg, three times that of the slide
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    add_body(builder, "slide", Box{{0.2, 0.2, 0.2}}, 1, {kPlace, 0.2, 1}, 0.5);
    builder.tie("rail", JointType::kPrismatic, "", "slide", {kPlace, 0.2, 1}, Eigen::Vector3d::UnitZ())
        .properties.axes[0]
        .armature = kArmature;
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const double fall = kGravity / (1 + kArmature);
    const Glance& end = course.last("slide");
    const double way = course.first("slide").place.z() - end.place.z();
    const double seconds = 1;
    return {{"speed", "m/s", fall * seconds, -end.velocity.z(), 1e-4},
            {"way", "m", fall * seconds * seconds / 2, way, 0.6 * fall * seconds * course.dt()}};
  };
  return scene;
}

// (I + m r^2 + armature) angle'' = -m g r angle
Scene swings_with_a_motor() {
  Scene scene = joint_scene("swings_with_a_motor", 10);
  static constexpr double kReach = 0.5;
  static constexpr double kArmature = 0.4;  // kg m^2
  static constexpr double kAngle = 0.05;    // rad, from hanging down
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    const Eigen::Vector3d axle(kPlace, 0.2, 2);
    const Eigen::Vector3d out(std::sin(kAngle), 0, -std::cos(kAngle));
    BodyDescription& bob = add_body(builder, "bob", Sphere{0.1}, 1, axle + kReach * out, 0.5);
    bob.properties.inertia = {0.004, 0.004, 0.004};
    builder.tie("axle", JointType::kRevolute, "", "bob", axle, Eigen::Vector3d::UnitY())
        .properties.axes[0]
        .armature = kArmature;
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const double rate = std::sqrt(kGravity * kReach / (0.004 + kReach * kReach + kArmature));
    double widest = 0;  // of the last period
    const std::vector<Glance>& all = course.of("bob");
    const auto ticks = static_cast<std::ptrdiff_t>(2 * EIGEN_PI / rate / course.dt());
    for (auto glance = all.end() - ticks; glance != all.end(); ++glance)
      widest = std::max(widest, std::abs(glance->place.x() - kPlace) / kReach);
    const double end = (course.last("bob").place.x() - kPlace) / kReach;
    return {{"amplitude", "rad", kAngle, widest, 0.005 * kAngle},
            {"angle", "rad", kAngle * std::cos(rate * 10), end, 0.02 * kAngle}};
  };
  return scene;
}

}  // namespace

std::vector<Scene> robot_scenes() {
  return {falls_with_a_motor(),
          swings_with_a_motor(),
          step_response(),
          holds_a_load(),
          holds_by_stiff_gains(),
          trapezoid(),
          turns_on_two_wheels(Tread::kBall),
          turns_on_two_wheels(Tread::kCylinder),
          steers(Tread::kBall),
          steers(Tread::kCylinder)};
}

}  // namespace tessera::truth
