// What moves on the ground.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <initializer_list>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lpss/base/portable_math.h"
#include "worlds/gazebo/system_kinds.h"

namespace tessera::gazebo {
namespace {

using xml::Element;

struct WheelSizes {
  double diameter = 0.4;  // m
  double separation = 1;
};

void drive_wheels(System& system, const WheelSizes& otherwise) {
  std::vector<std::string> left =
      system.texts({"left_joint", "leftJoint", "leftFrontJoint", "leftRearJoint"});
  std::vector<std::string> right =
      system.texts({"right_joint", "rightJoint", "rightFrontJoint", "rightRearJoint"});
  if (left.empty() || right.empty()) return system.fail("it names no joint of a wheel on each side");
  constexpr std::array<std::array<const char*, 2>, 3> kPairs = {
      {{"left", "right"}, {"left_2", "right_2"}, {"left_3", "right_3"}}};
  if (std::max(left.size(), right.size()) > kPairs.size())
    system.note("more than three wheels on a side roll freely");
  ProgramWriter program("diff_drive", system.name());
  Element* first = nullptr;
  for (std::size_t n = 0; n < kPairs.size(); ++n) {
    for (const auto& [wheels, number] : {std::pair{&left, kPairs[n][0]}, std::pair{&right, kPairs[n][1]}}) {
      if (n >= wheels->size()) continue;
      Element* const joint = system.joint((*wheels)[n]);
      if (joint == nullptr) return;
      if (first == nullptr) first = joint;
      program.set(number, system.name_of(*joint));
    }
  }
  const double diameter = system.number({"wheel_diameter", "wheelDiameter"}, otherwise.diameter);
  program.set("radius", system.number({"wheel_radius"}, diameter / 2))
      .set("track", system.number({"wheel_separation", "wheelSeparation"}, otherwise.separation))
      .set("acceleration", accelerates(system.number({"max_linear_acceleration", "max_acceleration",
                                                      "max_wheel_acceleration", "wheelAcceleration"},
                                                     0)))
      .set("turn_acceleration",
           accelerates(system.number({"max_angular_acceleration", "max_acceleration"}, 0)));
  const double speed = system.number({"max_linear_velocity", "max_velocity"}, 0);
  const double turn = system.number({"max_angular_velocity", "max_velocity"}, 0);
  if (speed > 0) program.set("speed_max", std::min(speed, 100.0));
  if (turn > 0) program.set("turn_max", std::min(turn, 100.0));
  if (Element* const link = system.chassis(*first)) system.write(program, *link);
}

// The joint of a name whose parent is not what one of the others steers.
Element* joint_on(System& system, const std::vector<std::string>& names, const Element* knuckle) {
  for (const std::string& name : names) {
    Element* const joint = system.joint(name);
    if (joint == nullptr) return nullptr;
    if (system.parts().side(*joint, "parent") != knuckle || knuckle == nullptr) return joint;
  }
  return system.joint(names.front());
}

// A number below children of the plugin; 0 where there is none.
double number_below(System& system, std::initializer_list<const char*> way) {
  Numbers numbers;
  const double number = numbers.read(find(&system.plugin(), way), 0);
  if (!numbers.status().ok()) system.fail(numbers.status().message());
  return number;
}

void write_planar(System& system, double acceleration, Element& link) {
  ProgramWriter program("velocity_control", system.name());
  program.set("planar", 1).set("acceleration", accelerates(acceleration));
  system.write(program, link);
}

// The places of a trajectory, in the axes that the number `axes` of the program tells. Empty: there are none.
struct Course {
  double axes = 0;
  std::vector<Eigen::Vector2d> places;
};

Course course_of(System& system) {
  const Element& plugin = system.plugin();
  Course course;
  for (const Element* place = find(&plugin, {"waypoints", "waypoint"}); place != nullptr;
       place = place->NextSiblingElement("waypoint")) {
    const absl::StatusOr<std::vector<double>> numbers = xml::numbers_in(*place, xml::text_of(*place));
    if (!numbers.ok() || numbers->size() < 2) {
      system.fail("a <waypoint> must have two numbers");
      return {};
    }
    course.places.emplace_back((*numbers)[0], (*numbers)[1]);
  }
  if (plugin.FirstChildElement("waypoints") != nullptr) return course;
  if (plugin.FirstChildElement("circle") != nullptr) {
    constexpr int kPlaces = 8;  // as in Gazebo
    const double radius = number_below(system, {"circle", "radius"});
    course.axes = 1;
    for (int n = 0; n < kPlaces; ++n) {
      const auto [sin, cos] = portable::sincos(2 * std::numbers::pi * n / kPlaces);
      course.places.emplace_back(radius * cos, radius * sin);
    }
  } else if (plugin.FirstChildElement("line") != nullptr) {
    const double length = number_below(system, {"line", "length"});
    const auto [sin, cos] = portable::sincos(number_below(system, {"line", "direction"}));
    course.axes = 2;
    course.places = {{0, 0}, {length * cos, length * sin}};
  }
  return course;
}

}  // namespace

void take_diff_drive(System& system) { drive_wheels(system, {}); }

// Of Gazebo classic, which measures the wheels that the first two joints have.
void take_measured_drive(System& system) {
  const Element* wheels[2] = {};
  for (const auto& [side, spellings] :
       {std::pair{0, system.text({"left_joint"})}, std::pair{1, system.text({"right_joint"})}}) {
    const Element* const joint = system.joint(spellings);
    if (joint == nullptr) return;
    wheels[side] = system.side(*joint, "child");
    if (wheels[side] == nullptr) return;
  }
  const auto place_of = [](const Element& link) {
    const Element* const pose = link.FirstChildElement("pose");
    const absl::StatusOr<xml::RelativePose> given =
        pose == nullptr ? xml::RelativePose{} : xml::pose_of(*pose);
    return given.ok() ? given->pose.position : Eigen::Vector3d(Eigen::Vector3d::Zero());
  };
  WheelSizes sizes;
  sizes.separation = (place_of(*wheels[0]) - place_of(*wheels[1])).norm();
  for (const char* shape : {"cylinder", "sphere"}) {
    const Element* const radius = find(wheels[0], {"collision", "geometry", shape, "radius"});
    Numbers numbers;
    if (radius != nullptr) sizes.diameter = 2 * numbers.read(radius, sizes.diameter / 2);
  }
  drive_wheels(system, sizes);
}

void take_ackermann(System& system) {
  ProgramWriter program("ackermann", system.name());
  Element* first = nullptr;
  for (const auto& [side, steer, wheel, number, steer_number] :
       {std::array{"left", "left_steering_joint", "left_joint", "left", "left_steer"},
        std::array{"right", "right_steering_joint", "right_joint", "right", "right_steer"}}) {
    const std::vector<std::string> wheels = system.texts({wheel});
    const std::string steering = system.text({steer});
    if (wheels.empty() || steering.empty())
      return system.fail(absl::StrCat("it names no <", wheel, "> and <", steer, ">"));
    const Element* const knuckle_joint = system.joint(steering);
    if (knuckle_joint == nullptr) return;
    Element* const joint = joint_on(system, wheels, system.parts().side(*knuckle_joint, "child"));
    if (joint == nullptr) return;
    if (first == nullptr) first = joint;
    program.set(number, system.name_of(*joint)).set(steer_number, system.name_of(*knuckle_joint));
  }
  const double separation = system.number({"wheel_separation"}, 1);
  program.set("radius", system.number({"wheel_radius"}, 0.2))
      .set("wheelbase", system.number({"wheel_base"}, 1))
      .set("track", separation)
      .set("steer_track", system.number({"kingpin_width"}, 0.8))
      .set("steer_angle", system.number({"steering_limit"}, 0.5))
      .set("acceleration", accelerates(system.number({"max_acceleration"}, 0)));
  if (Element* const link = system.chassis(*first)) system.write(program, *link);
}

void take_velocity_control(System& system) {
  Element* const link = system.first_link();
  if (link == nullptr) return;
  const Eigen::Vector3d velocity = system.vector("initial_linear", Eigen::Vector3d::Zero());
  const Eigen::Vector3d turn = system.vector("initial_angular", Eigen::Vector3d::Zero());
  ProgramWriter program("velocity_control", system.name());
  program.set("x", velocity.x())
      .set("y", velocity.y())
      .set("z", velocity.z())
      .set("turn_x", turn.x())
      .set("turn_y", turn.y())
      .set("turn_z", turn.z());
  if (system.plugin().FirstChildElement("link_name") != nullptr)
    system.note("<link_name> is not used: the first link of its model is led");
  system.write(program, *link);
}

void take_planar_move(System& system) {
  const std::string name = system.text({"robot_base_frame", "robotBaseFrame"});
  const std::optional<ModelParts::Place> named = system.parts().place(name);
  if (Element* const link = named ? named->link : system.first_link()) {
    write_planar(system, 0, *link);
    system.write(ProgramWriter("pose", "odom"), *link);
  }
}

void take_mecanum_drive(System& system) {
  const std::vector<std::string> names = system.texts({"front_left_joint"});
  if (names.empty()) return system.fail("it names no <front_left_joint>");
  const Element* const joint = system.joint(names.front());
  if (joint == nullptr) return;
  if (Element* const link = system.chassis(*joint)) {
    system.note("its body is led, and its wheels follow: they have no rollers");
    write_planar(system, system.number({"max_linear_acceleration", "max_acceleration"}, 0), *link);
  }
}

void take_tracked_vehicle(System& system) {
  const std::string name = system.text({"body_link"});
  const std::optional<ModelParts::Place> place =
      name.empty() ? ModelParts::Place{system.first_link(), {}} : system.place(name);
  if (!place || place->link == nullptr) return;
  ProgramWriter program("treads", system.name());
  for (const auto& [side, numbers] : {std::pair{"left_track", std::array{"left", "left_2", "left_3"}},
                                      std::pair{"right_track", std::array{"right", "right_2", "right_3"}}}) {
    std::size_t n = 0;
    for (const Element* track = system.plugin().FirstChildElement(side); track != nullptr;
         track = track->NextSiblingElement(side), ++n) {
      if (n == numbers.size()) {
        system.note("more than three tracks on a side stand");
        break;
      }
      const std::optional<ModelParts::Place> link = system.place(xml::child_text(*track, "link"));
      if (!link) return;
      program.set(numbers[n], system.name_of(*link->link));
    }
    if (n == 0) return system.fail(absl::StrCat("it names no <", side, ">"));
  }
  constexpr double kCorrection = 2;  // 1/s
  program.set("separation", system.number({"tracks_separation"}, 1))
      .set("correction", kCorrection)
      .set("efficiency", system.number({"steering_efficiency"}, 0.5))
      .set("acceleration", accelerates(number_below(system, {"linear_velocity", "max_acceleration"})))
      .set("turn_acceleration", accelerates(number_below(system, {"angular_velocity", "max_acceleration"})));
  system.write(program, *place->link);
}

// The surface of a link.
void take_track_controller(System& system) {
  const std::optional<ModelParts::Place> place = system.place(system.text({"link"}));
  if (!place) return;
  if (system.parts().is_static()) system.parts().make_kinematic();
  ProgramWriter program("belt", system.name());
  program.set("round", 1).set("acceleration", accelerates(system.number({"max_acceleration"}, 0)));
  system.write(program, *place->link);
}

void take_trajectory_follower(System& system) {
  constexpr std::size_t kPlacesMax = 64;
  constexpr double kDegree = std::numbers::pi / 180;
  const std::optional<ModelParts::Place> place = system.place(system.text({"link_name"}));
  if (!place) return;
  const Course course = course_of(system);
  if (course.places.empty()) return system.fail("it has no <waypoint>, <circle> or <line>");
  if (course.places.size() > kPlacesMax)
    return system.fail(absl::StrCat(course.places.size(), " waypoints must be at most ", kPlacesMax,
                                    ", as a program has them"));
  ProgramWriter program("waypoints", system.name());
  program.set("count", static_cast<double>(course.places.size()))
      .set("axes", course.axes)
      .set("loop", system.flag("loop", false) ? 1 : 0)
      .set("force", system.number({"force"}, 60))
      .set("torque", system.number({"torque"}, 50))
      .set("range", system.number({"range_tolerance"}, 0.5))
      .set("bearing", system.number({"bearing_tolerance"}, 2) * kDegree)
      .set("hold", system.flag("zero_vel_on_bearing_reached", false) ? 1 : 0);
  for (std::size_t n = 0; n < course.places.size(); ++n) {
    program.set(absl::StrCat("x_", n), course.places[n].x()).set(absl::StrCat("y_", n), course.places[n].y());
  }
  system.write(program, *place->link);
}

}  // namespace tessera::gazebo
