// Programs that sense: what they publish, against what they should.
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "experiments/truth/scene_parts.h"
#include "lpss/simulation/example_programs.h"

namespace tessera::truth {
namespace {

using Eigen::Vector3d;

constexpr double kDegree = EIGEN_PI / 180;

// A cube of kCube on a floor, under a gravity that leans by kLean to the side.
constexpr double kCube = 0.5;   // m
constexpr double kMass = 3;     // kg
constexpr double kLean = 0.35;  // rad

WorldDescription cube_on_slope(const WorldSettings& settings, absl::string_view kind,
                               const ProgramNumbers& numbers = {}) {
  WorldBuilder builder = on_slope(settings, kLean, 1);
  add_body(builder, "cube", Box{{kCube, kCube, kCube}}, kMass, {kPlace, 0.2, kCube / 2}, 1)
      .programs.push_back(example_program(kind, numbers));
  return builder.world();
}

// What stands on a slope feels what holds it: g sin and g cos along its axes.
Scene feels_the_slope() {
  Scene scene = program_scene("imu_on_a_slope", 2);
  scene.world = [](const WorldSettings& settings) { return cube_on_slope(settings, "imu"); };
  scene.results = [](const Course& course) -> Results {
    return {{"along the slope", "m/s^2", -kGravity * std::sin(kLean),
             course.published("cube", "acceleration_x"), 0.01},
            {"out of the slope", "m/s^2", kGravity * std::cos(kLean),
             course.published("cube", "acceleration_z"), 0.01}};
  };
  return scene;
}

// One that is turned by a right angle about the x axis: its y axis is the cube's z axis.
Scene feels_the_slope_mounted() {
  Scene scene = program_scene("imu_that_is_turned", 2);
  scene.world = [](const WorldSettings& settings) {
    return cube_on_slope(settings, "imu", {{"roll", EIGEN_PI / 2}});
  };
  scene.results = [](const Course& course) -> Results {
    return {{"along its y axis", "m/s^2", kGravity * std::cos(kLean),
             course.published("cube", "acceleration_y"), 0.01},
            {"turned about x", "rad", EIGEN_PI / 2, 2 * std::asin(course.published("cube", "qx")), 1e-3}};
  };
  return scene;
}

// Away from the axis of a disc: w^2 r towards it.
Scene feels_the_turn() {
  Scene scene = program_scene("imu_on_a_disc", 2);
  scene.has_order = true;
  static constexpr double kRate = 6;      // rad/s
  static constexpr double kRadius = 0.5;  // m
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, Vector3d::Zero()));
    BodyDescription& disc = add_body(builder, "disc", Cylinder{1, 0.2}, 2, {kPlace, 0.2, 1}, 0.5);
    disc.angular_velocity = {0, 0, kRate};
    disc.programs.push_back(example_program("imu", {{"x", kRadius}}));
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const double right = kRate * kRate * kRadius;
    return {{"to the axis", "m/s^2", right, -course.published("disc", "acceleration_x"), 5e-4 * right},
            {"rate of turn", "rad/s", kRate, course.published("disc", "turn_z"), 1e-5 * kRate}};
  };
  return scene;
}

// A cube on a slope is pressed with m g cos.
Scene is_pressed() {
  Scene scene = program_scene("touch_on_a_slope", 2);
  scene.world = [](const WorldSettings& settings) { return cube_on_slope(settings, "touch"); };
  scene.results = [](const Course& course) -> Results {
    const double right = kMass * kGravity * std::cos(kLean);
    return {{"force", "N", right, course.published("cube", "force"), 2e-3 * right},
            {"force along z", "N", right, course.published("cube", "force_z"), 2e-3 * right}};
  };
  return scene;
}

// A joint bears an arm that sticks out by its half: m g, and m g l / 2 about the joint.
Scene is_loaded() {
  Scene scene = program_scene("load_of_an_arm", 2);
  static constexpr double kLength = 1;  // m
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    add_body(builder, "arm", Box{{kLength, 0.1, 0.1}}, kMass, {kPlace + kLength / 2, 0.2, 1}, 0.5)
        .programs.push_back(example_program("load", {{"joint", 1}}));
    builder.tie("root", JointType::kFixed, "", "arm", {kPlace, 0.2, 1});
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const double weight = kMass * kGravity;
    return {{"force", "N", weight, course.published("arm", "force_z"), 1e-3 * weight},
            {"torque", "N m", -weight * kLength / 2, course.published("arm", "torque_y"), 1e-3 * weight}};
  };
  return scene;
}

// The same by a sensor that is turned by a right angle about the x axis of the arm, of what the parent bears.
Scene is_loaded_mounted() {
  Scene scene = program_scene("load_by_a_sensor_that_is_turned", 2);
  static constexpr double kLength = 1;  // m
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    add_body(builder, "arm", Box{{kLength, 0.1, 0.1}}, kMass, {kPlace + kLength / 2, 0.2, 1}, 0.5)
        .programs.push_back(
            example_program("load", {{"joint", 1}, {"frame", 1}, {"roll", EIGEN_PI / 2}, {"direction", -1}}));
    builder.tie("root", JointType::kFixed, "", "arm", {kPlace, 0.2, 1});
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const double weight = kMass * kGravity;
    return {{"force", "N", -weight, course.published("arm", "force_y"), 1e-3 * weight},
            {"torque", "N m", -weight * kLength / 2, course.published("arm", "torque_z"), 1e-3 * weight}};
  };
  return scene;
}

// A fan of rays at a wall: d / cos of the angle at which each meets it.
Scene ranges() {
  Scene scene = program_scene("ranger_at_a_wall", 0.2);
  static constexpr double kAway = 2.5;  // m
  static constexpr double kFan = 1.2;   // rad, of three rays
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, Vector3d::Zero()));
    BodyDescription& wall = builder.add("wall", builder.shape(Box{{1, 20, 4}}), 1,
                                        {kPlace + kAway - 1 + 0.5, 0, 0}, Motion::kStatic);
    wall.properties.friction = 0.5;
    builder.add("eye", builder.shape(Sphere{0.1}), 1, {kPlace - 1, 0.2, 0.1}, Motion::kKinematic)
        .programs.push_back(example_program("ranger", {{"rays", 3}, {"angle", kFan}}));
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const double aslant = kAway / std::cos(kFan / 2);
    return {{"to the right", "m", aslant, course.published("eye", "range_0"), 1e-5},
            {"ahead", "m", kAway, course.published("eye", "range_1"), 1e-5},
            {"to the left", "m", aslant, course.published("eye", "range_2"), 1e-5}};
  };
  return scene;
}

// Three rows of three rays at a wall: d / (cos cos) of both angles.
Scene ranges_in_rows() {
  Scene scene = program_scene("ranger_in_rows_at_a_wall", 0.2);
  static constexpr double kAway = 2.5;  // m
  static constexpr double kFan = 1.2;   // rad, of the rays of a row
  static constexpr double kRise = 0.6;  // rad, of the rows
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, Vector3d::Zero()));
    builder.add("wall", builder.shape(Box{{1, 20, 6}}), 1, {kPlace + kAway - 1 + 0.5, 0, 0}, Motion::kStatic);
    builder.add("eye", builder.shape(Sphere{0.1}), 1, {kPlace - 1, 0.2, 0.1}, Motion::kKinematic)
        .programs.push_back(example_program(
            "ranger", {{"rays", 3}, {"angle", kFan}, {"rows", 3}, {"row_angle", kRise}, {"rate", 10}}));
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const double high = kAway / std::cos(kRise / 2);
    return {{"below to the right", "m", high / std::cos(kFan / 2), course.published("eye", "range_0"), 1e-5},
            {"ahead", "m", kAway, course.published("eye", "range_4"), 1e-5},
            {"above, ahead", "m", high, course.published("eye", "range_7"), 1e-5}};
  };
  return scene;
}

// The pixels of a depth camera: the corner of four by two, at tan(angle / 2) (3/4, 1/2) of the wall.
Scene sees_a_wall() {
  Scene scene = program_scene("depth_camera_at_a_wall", 0.2);
  static constexpr double kAway = 2.5;  // m
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, Vector3d::Zero()));
    builder.add("wall", builder.shape(Box{{1, 20, 6}}), 1, {kPlace + kAway - 1 + 0.5, 0, 0}, Motion::kStatic);
    builder.add("eye", builder.shape(Sphere{0.1}), 1, {kPlace - 1, 0.2, 0.1}, Motion::kKinematic)
        .programs.push_back(example_program("ranger", {{"rays", 4},
                                                       {"angle", 2 * std::atan(0.8)},
                                                       {"rows", 2},
                                                       {"row_angle", 2 * std::atan(0.4)},
                                                       {"plane", 1}}));
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const double corner = kAway * Vector3d(1, 0.8 * 0.75, 0.4 * 0.5).norm();
    const double inner = kAway * Vector3d(1, 0.8 * 0.25, 0.4 * 0.5).norm();
    return {{"lower right corner", "m", corner, course.published("eye", "range_0"), 1e-5},
            {"upper left corner", "m", corner, course.published("eye", "range_7"), 1e-5},
            {"beside the middle", "m", inner, course.published("eye", "range_5"), 1e-5}};
  };
  return scene;
}

// The field of the world along the axes of a body that is turned by an angle: f cos and -f sin.
Scene finds_north() {
  Scene scene = program_scene("magnetometer_that_is_turned", 0.2);
  static constexpr double kAngle = 0.7;   // rad, about z
  static constexpr double kField = 2e-5;  // T, along the world's x axis
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, Vector3d::Zero()));
    BodyDescription& ball =
        builder.add("ball", builder.shape(Sphere{0.1}), 1, {kPlace, 0.2, 1}, Motion::kKinematic);
    ball.pose.orientation = Eigen::Quaterniond(std::cos(kAngle / 2), 0, 0, std::sin(kAngle / 2));
    ball.programs.push_back(
        example_program("magnetometer", {{"field_x", kField}, {"field_y", 0}, {"field_z", -3e-5}}));
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    return {{"along its x axis", "T", kField * std::cos(kAngle), course.published("ball", "field_x"), 1e-12},
            {"along its y axis", "T", -kField * std::sin(kAngle), course.published("ball", "field_y"), 1e-12},
            {"along its z axis", "T", -3e-5, course.published("ball", "field_z"), 1e-12}};
  };
  return scene;
}

// Pressures of table I of the U.S. Standard Atmosphere, 1976, by geometric altitude.
Scene feels_the_air() {
  Scene scene = program_scene("barometer_at_heights", 0.2);
  struct Row {
    const char* name;
    double height;    // m
    double pressure;  // Pa
  };
  static constexpr std::array<Row, 4> kTable = {{{"at the sea", 0, 101325},
                                                 {"at 1 km", 1000, 89876},
                                                 {"at 10 km", 10000, 26500},
                                                 {"at 20 km", 20000, 5529.3}}};
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    double y = 0;
    for (const Row& row : kTable) {
      builder.add(row.name, builder.shape(Sphere{0.1}), 1, {kPlace, y += 0.4, 1}, Motion::kKinematic)
          .programs.push_back(example_program("barometer", {{"height", row.height}}));
    }
    return builder.world();
  };
  scene.results = [](const Course& course) {
    Results results;
    for (const Row& row : kTable) {
      results.push_back(
          {row.name, "Pa", row.pressure, course.published(row.name, "pressure"), 1e-4 * row.pressure});
    }
    return results;
  };
  return scene;
}

// A ball that flies and turns, over the border: v t and w t from where it was, and v along its own axes.
Scene follows_its_pose() {
  Scene scene = program_scene("pose_in_flight", 2);
  scene.has_order = true;
  static constexpr double kSpeed = 0.8;  // m/s
  static constexpr double kRate = 0.5;   // rad/s
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, Vector3d::Zero()));
    BodyDescription& ball = add_body(builder, "ball", Sphere{0.2}, 1, {kPlace - 0.9, 0.2, 1}, 0.5);
    ball.linear_velocity = {kSpeed, 0, 0};
    ball.angular_velocity = {0, 0, kRate};
    ball.programs.push_back(example_program("pose"));
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const double angle = kRate * course.seconds();
    return {{"way", "m", kSpeed * course.seconds(), course.published("ball", "x"), 1e-4},
            {"turn", "rad", angle, 2 * std::asin(course.published("ball", "qz")), 1e-4},
            {"velocity along its x axis", "m/s", kSpeed * std::cos(angle),
             course.published("ball", "velocity_x"), 1e-4},
            {"velocity along its y axis", "m/s", -kSpeed * std::sin(angle),
             course.published("ball", "velocity_y"), 1e-4}};
  };
  return scene;
}

// It falls by g t^2 / 2.
Scene falls_by_altimeter() {
  Scene scene = program_scene("altimeter_in_a_fall", 2);
  scene.has_order = true;
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    add_body(builder, "ball", Sphere{0.1}, 1, {kPlace, 0.2, 0}, 0.5)
        .programs.push_back(example_program("altimeter"));
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const double time = course.seconds();
    const double fallen = kGravity * time * time / 2;
    return {{"height", "m", -fallen, course.published("ball", "height"), 0.01 * fallen},
            {"climb", "m/s", -kGravity * time, course.published("ball", "climb"), 1e-3}};
  };
  return scene;
}

// To the east at 60 degrees north: d / ((N + h) cos), with N of the ellipsoid; the ground falls away by
// d^2 / 2 (N + h) below a straight way.
Scene follows_the_earth() {
  Scene scene = program_scene("satellite_to_the_east", 4);
  static constexpr double kLatitude = 60;           // degrees
  static constexpr double kHeight = 250;            // m
  static constexpr double kSpeed = 300;             // m/s
  static constexpr double kEquator = 6378137;       // m, of WGS 84
  static constexpr double kSquare = 0.00669437999;  // its eccentricity, squared
  scene.world = [](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, Vector3d::Zero()));
    BodyDescription& ball = add_body(builder, "ball", Sphere{0.2}, 1, {kPlace, 0.2, 1}, 0.5);
    ball.linear_velocity = {kSpeed, 0, 0};
    ball.programs.push_back(
        example_program("satellite", {{"latitude", kLatitude}, {"longitude", 10}, {"height", kHeight}}));
    return builder.world();
  };
  scene.results = [](const Course& course) -> Results {
    const double sine = std::sin(kLatitude * kDegree);
    const double radius = kEquator / std::sqrt(1 - kSquare * sine * sine) + kHeight;
    const double way = kSpeed * course.seconds();
    const double degrees = way / (radius * std::cos(kLatitude * kDegree)) / kDegree;
    return {
        {"degrees to the east", "deg", degrees, course.published("ball", "longitude") - 10, 1e-5 * degrees},
        {"height", "m", kHeight + way * way / (2 * radius), course.published("ball", "height"), 1e-3},
        {"velocity to the east", "m/s", kSpeed, course.published("ball", "east"), 1e-3}};
  };
  return scene;
}

}  // namespace

std::vector<Scene> sensor_scenes() {
  return {feels_the_slope(),
          feels_the_slope_mounted(),
          feels_the_turn(),
          is_pressed(),
          is_loaded(),
          is_loaded_mounted(),
          ranges(),
          ranges_in_rows(),
          sees_a_wall(),
          follows_its_pose(),
          falls_by_altimeter(),
          feels_the_air(),
          finds_north(),
          follows_the_earth()};
}

}  // namespace tessera::truth
