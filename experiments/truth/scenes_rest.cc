// What friction holds: bodies, what joints hold together, robots and grippers stay where they are.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "experiments/truth/scene_parts.h"

namespace tessera::truth {
namespace {

using Eigen::Vector3d;

constexpr double kFriction = 0.8;
constexpr double kFirst = 1;     // s: what gives way at the start does so within it
constexpr double kLast = 10;     // s, at the end
constexpr double kCreep = 1e-4;  // m, after the first second
constexpr double kStandstill =
    1e-6;  // m, in the last seconds: 0, but for how a float rounds places of metres

double slope_of(double share) { return std::atan(share * kFriction); }

// mm, of the body that goes farthest. The end is looked at where it is long after the start.
Results stand_still(const Course& course) {
  double creep = 0, end = 0;
  for (const BodyDescription& body : course.world().bodies) {
    if (body.properties.motion != Motion::kDynamic) continue;
    creep = std::max(creep, way(course, body.name, kFirst));
    end = std::max(end, way(course, body.name, course.seconds() - kLast));
  }
  Results results = {{"creep after the first second", "mm", 0, creep * 1e3, kCreep * 1e3}};
  if (course.seconds() >= 2 * kLast)
    results.push_back({"creep in the last ten seconds", "mm", 0, end * 1e3, kStandstill * 1e3});
  return results;
}

Scene rest(const std::string& name, std::function<WorldDescription(const WorldSettings&)> world) {
  Scene scene;
  scene.group = "rest";
  scene.name = name;
  scene.world = std::move(world);
  scene.seconds = 60;
  scene.quick_seconds = 3;
  scene.results = stand_still;
  return scene;
}

WorldDescription body_world(const WorldSettings& settings, double slope) {
  WorldBuilder builder = on_slope(settings, slope, kFriction);
  add_body(builder, "box", Box{{1, 1, 0.2}}, 20, {kPlace, 0, 0.1}, kFriction);
  return builder.world();
}

// A foot of 1 kg with a load of `load` kg on it, on a box that is tilted itself, turned by `turn` (rad) about
// its normal.
WorldDescription tilted_world(const WorldSettings& settings, double slope, double load, double turn) {
  WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
  const Eigen::Quaterniond tilt =
      Eigen::AngleAxisd(0.5, Vector3d::UnitZ()) * Eigen::AngleAxisd(slope, Vector3d::UnitY());
  const auto at = [&](double height) -> Vector3d {
    return Vector3d(kPlace, 0, 0) + height * (tilt * Vector3d::UnitZ());
  };
  BodyDescription& floor = builder.add("floor", builder.shape(Box{{6, 6, 1}}), 1, at(-0.5), Motion::kStatic);
  floor.pose.orientation = tilt;
  floor.properties.friction = kFriction;
  const Eigen::Quaterniond turned = tilt * Eigen::AngleAxisd(turn, Vector3d::UnitZ());
  add_body(builder, "foot", Box{{1, 1, 0.2}}, 1, at(0.1), kFriction).pose.orientation = turned;
  add_body(builder, "load", Box{{0.8, 0.8, 0.4}}, load, at(0.4), kFriction).pose.orientation = turned;
  builder.tie("weld", JointType::kFixed, "foot", "load", at(0.2));
  return builder.world();
}

// What touches the ground has 1 kg, and bears `load` kg.
WorldDescription pair_world(const WorldSettings& settings, double slope, double load) {
  WorldBuilder builder = on_slope(settings, slope, kFriction);
  add_body(builder, "foot", Box{{1, 1, 0.2}}, 1, {kPlace, 0, 0.1}, kFriction);
  add_body(builder, "load", Box{{0.8, 0.8, 0.4}}, load, {kPlace, 0, 0.4}, kFriction);
  builder.tie("weld", JointType::kFixed, "foot", "load", {kPlace, 0, 0.2});
  return builder.world();
}

// Four wheels of 1 kg that do not turn, on springs that bear `load` kg each, 5 cm pressed in.
WorldDescription car_world(const WorldSettings& settings, double slope, double load, bool across = false) {
  constexpr double kWheelRadius = 0.3, kPressed = 0.05;
  WorldBuilder builder = on_slope(settings, slope, kFriction);
  if (across) builder.world().settings.gravity = UniformGravity{slope_pull(slope, Vector3d::UnitY())};
  add_body(builder, "chassis", Box{{2.4, 1.2, 0.2}}, 4 * load, {kPlace, 0, 0.5}, 0.3);
  const double weight = load * kGravity * std::cos(slope);
  const double stiffness = weight / kPressed;
  int number = 0;
  for (const double along : {0.9, -0.9}) {
    for (const double sideways : {0.8, -0.8}) {
      const std::string name = absl::StrCat("wheel", number++);
      const Vector3d place(kPlace + along, sideways, kWheelRadius);
      BodyDescription& wheel = add_body(builder, name, Cylinder{kWheelRadius, 0.2}, 1, place, kFriction);
      wheel.pose.orientation = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), Vector3d::UnitY());
      JointDescription& spring =
          builder.tie("spring_" + name, JointType::kPrismatic, "chassis", name, place, Vector3d::UnitZ());
      JointAxis& axis = spring.properties.axes[0];
      axis.spring_stiffness = stiffness;
      axis.spring_reference = -kPressed;  // it pushes the wheel down
      axis.damping = 2 * std::sqrt(stiffness * load);
    }
  }
  return builder.world();
}

// Four legs of two links of 0.1 kg, whose hips and knees servos hold, under `load` kg each.
WorldDescription quadruped_world(const WorldSettings& settings, double slope, double load) {
  constexpr double kLink = 0.2, kThick = 0.02;  // m; links end in balls
  const double bend = 0.4;                      // rad, of the thigh to the back, and the shank to the front
  WorldBuilder builder = on_slope(settings, slope, kFriction);
  const double hip = 2 * kLink * std::cos(bend) + kThick;
  add_body(builder, "trunk", Box{{0.9, 0.7, 0.1}}, 4 * load, {kPlace, 0, hip}, 0.5);
  const double torque = load * kGravity * kLink;  // N m: what a leg has to hold is of this size
  const JointDrive servo{DriveMode::kServo, 0, 500 * torque, 20 * torque, 0, 0};
  int number = 0;
  for (const double along : {0.4, -0.4}) {
    for (const double sideways : {0.4, -0.4}) {
      const std::string leg = absl::StrCat("_", number++);
      const Vector3d top(kPlace + along, sideways, hip);
      const Vector3d knee = top + kLink * Vector3d(-std::sin(bend), 0, -std::cos(bend));
      const Vector3d foot = knee + kLink * Vector3d(std::sin(bend), 0, -std::cos(bend));
      const auto add_link = [&](const std::string& name, const Vector3d& from, const Vector3d& to,
                                const std::string& parent) {
        BodyDescription& link =
            add_body(builder, name, Capsule{kThick, kLink}, 0.1, (from + to) / 2, kFriction);
        link.pose.orientation = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), to - from);
        builder.tie("joint_" + name, JointType::kRevolute, parent, name, from, Vector3d::UnitY()).drives[0] =
            servo;
      };
      add_link("thigh" + leg, top, knee, "trunk");
      add_link("shank" + leg, knee, foot, "thigh" + leg);
    }
  }
  for (BodyDescription& body : builder.world().bodies)
    body.properties.assembly = body.name == "ground" ? 0 : 1;
  return builder.world();
}

// Two fingers of 0.2 kg press on `load` kg from both sides, with 4.9 times the force that friction needs.
WorldDescription gripper_world(const WorldSettings& settings, double load, double beside) {
  WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
  add_body(builder, "object", Box{{0.1, 0.1, 0.1}}, load, {kPlace, 0, 1}, kFriction);
  const double force = 4.9 * load * kGravity / (2 * kFriction);
  for (const double side : {-1.0, 1.0}) {
    const std::string name = side < 0 ? "left" : "right";
    const Vector3d place(kPlace + side * 0.06, 0, 1 + beside);
    add_body(builder, name, Box{{0.02, 0.06, 0.08 + 2 * beside}}, 0.2, place, kFriction);
    JointDescription& slide =
        builder.tie("slide_" + name, JointType::kPrismatic, "", name, place, Vector3d(-side, 0, 0));
    slide.drives[0] = {DriveMode::kEffort, force};
  }
  return builder.world();
}

}  // namespace

std::vector<Scene> rest_scenes() {
  std::vector<Scene> scenes;
  for (const double share : {0.5, 0.95}) {
    const double slope = slope_of(share);
    const std::string where = absl::StrCat("_at_", share, "_of_the_friction_angle");
    scenes.push_back(rest("body" + where, [=](const auto& settings) { return body_world(settings, slope); }));
    for (const double load : {1.0, 10.0, 100.0, 1000.0}) {
      const std::string ratio = absl::StrCat("_1:", load, where);
      const auto add = [&](const std::string& name, auto world) {
        scenes.push_back(
            rest(name + ratio, [=](const auto& settings) { return world(settings, slope, load); }));
        scenes.back().in_quick = load == 10 || load == 1000;
      };
      add("pair", pair_world);
      add("car", [](const WorldSettings& settings, double lean, double mass) {
        return car_world(settings, lean, mass);
      });
      add("car_across", [](const WorldSettings& settings, double lean, double mass) {
        return car_world(settings, lean, mass, /*across=*/true);
      });
      add("quadruped", quadruped_world);
    }
  }
  for (const double load : {1.0, 100.0}) {
    for (const double turn : {0.0, 0.7}) {
      scenes.push_back(
          rest(absl::StrCat("pair_1:", load, "_on_a_tilted_box", turn > 0 ? "_turned" : ""),
               [=](const auto& settings) { return tilted_world(settings, slope_of(0.95), load, turn); }));
    }
  }
  for (const double load : {0.2, 1.0, 20.0, 200.0}) {
    for (const double beside : {0.0, 0.04}) {
      const std::string pads = beside > 0 ? "_pads_beside_their_centres" : "";
      scenes.push_back(rest(absl::StrCat("gripper_0.2:", load, pads),
                            [=](const auto& settings) { return gripper_world(settings, load, beside); }));
    }
  }
  return scenes;
}

}  // namespace tessera::truth
