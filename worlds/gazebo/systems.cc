#include "worlds/gazebo/systems.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/string_view.h>
#include <absl/strings/strip.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lpss/base/portable_math.h"
#include "worlds/gazebo/numbers.h"
#include "worlds/gazebo/program_writer.h"

namespace tessera::gazebo {
namespace {

using xml::Element;

constexpr double kUnlimited = 1e4;   // m/s^2, rad/s^2: what a program takes for it
constexpr double kUnbounded = 1e12;  // likewise, of efforts

// 0 or less is none.
double accelerates(double given) { return given > 0 ? std::min(given, kUnlimited) : kUnlimited; }
double bound(double given) { return given > 0 ? std::min(given, kUnbounded) : kUnbounded; }

// A plugin of a model, and what it names there.
class System {
 public:
  System(const Element& plugin, const ModelParts& parts, Notices& notices)
      : plugin_(plugin), parts_(parts), notices_(notices) {}

  const Element& plugin() const { return plugin_; }
  const ModelParts& parts() const { return parts_; }
  std::string name() const {
    const char* const name = plugin_.Attribute("name");
    return name == nullptr ? "" : name;
  }
  double number(std::initializer_list<const char*> spellings, double otherwise) {
    return numbers_.read(plugin_, spellings, otherwise);
  }
  bool flag(const char* name, bool otherwise) { return numbers_.read_bool(plugin_, name, otherwise); }
  std::string text(std::initializer_list<const char*> spellings) const {
    return text_of_any(plugin_, spellings);
  }
  // The texts of all children of a name.
  std::vector<std::string> texts(std::initializer_list<const char*> spellings) const {
    std::vector<std::string> texts;
    for (const char* name : spellings) {
      for (const Element* child = plugin_.FirstChildElement(name); child != nullptr;
           child = child->NextSiblingElement(name)) {
        texts.push_back(xml::text_of(*child));
      }
    }
    return texts;
  }

  std::string name_of(const Element& part) const { return parts_.name_of(part); }

  // Errors of what is named; each returns null, or nothing, then.
  Element* joint(const std::string& name) {
    Element* const found = parts_.joint(name);
    if (found == nullptr) fail(absl::StrCat("there is no joint '", name, "' in its model"));
    return found;
  }
  std::optional<ModelParts::Place> place(const std::string& name) {
    std::optional<ModelParts::Place> found = parts_.place(name);
    if (!found) fail(absl::StrCat("there is no link or frame '", name, "' in its model"));
    return found;
  }
  // The link that moves by a joint, or the one that it moves in.
  Element* side(const Element& joint, const char* side) {
    Element* const found = parts_.side(joint, side);
    if (found == nullptr) fail(absl::StrCat("the ", side, " of its joint is no link of its model"));
    return found;
  }
  // The link that wheels are mounted to, or else the first one.
  Element* chassis(const Element& joint) {
    Element* const found = parts_.side(joint, "parent");
    return found != nullptr ? found : first_link();
  }
  Element* first_link() {
    Element* const found = parts_.first_link();
    if (found == nullptr) fail("its model has no link");
    return found;
  }

  void write(const ProgramWriter& program, Element& link) {
    const absl::Status status = program.write(link);
    if (!status.ok()) return fail(status.message());
    programs_.push_back(program.kind());
  }
  void note(absl::string_view what) { notices_.count(absl::StrCat(title(), ": ", what)); }
  void fail(absl::string_view why) { status_.Update(absl::InvalidArgumentError(why)); }

  // Says what has come of it.
  void finish() {
    status_.Update(numbers_.status());
    if (!status_.ok()) {
      notices_.count_repair(absl::StrCat(title(), ", left out: ", status_.message()), xml::place_of(plugin_));
    } else if (!programs_.empty()) {
      const std::string kind = programs_.front();
      notices_.count(absl::StrCat(title(), " is the program ", kind), programs_.size());
    }
  }

  std::string title() const {
    const char* const file = plugin_.Attribute("filename");
    return file == nullptr ? "<plugin>" : absl::StrCat("<plugin> ", file);
  }

 private:
  const Element& plugin_;
  const ModelParts& parts_;
  Notices& notices_;
  Numbers numbers_;
  absl::Status status_;
  std::vector<std::string> programs_;
};

// --- Wheels ---

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

void diff_drive(System& system) { drive_wheels(system, {}); }

// Of Gazebo classic, which measures the wheels that the first two joints have.
void measured_drive(System& system) {
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

// The joint of a name whose parent is not what one of the others steers.
Element* joint_on(System& system, const std::vector<std::string>& names, const Element* knuckle) {
  for (const std::string& name : names) {
    Element* const joint = system.joint(name);
    if (joint == nullptr) return nullptr;
    if (system.parts().side(*joint, "parent") != knuckle || knuckle == nullptr) return joint;
  }
  return system.joint(names.front());
}

void ackermann(System& system) {
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

// --- Joints ---

struct Gains {
  double p = 0;
  double i = 0;
  double d = 0;
  double integral_max = 0;
  double effort_max = 0;
};

void write_pid(System& system, const std::string& name, const Gains& gains, bool is_of_rate,
               double set_point) {
  Element* const joint = system.joint(name);
  if (joint == nullptr) return;
  Element* const link = system.side(*joint, "child");
  if (link == nullptr) return;
  ProgramWriter program("pid", name);
  program.set("joint", system.name_of(*joint))
      .set("of_rate", is_of_rate ? 1 : 0)
      .set("p", gains.p)
      .set("i", gains.i)
      .set("d", is_of_rate ? 0 : gains.d)
      .set("integral_max", bound(gains.integral_max))
      .set("effort_max", bound(gains.effort_max))
      .set("set_point", set_point)
      .set("implicit", 1);  // gains are for the step of somebody else
  system.write(program, *link);
}

void drive_joint(System& system, const std::string& name, const char* mode, double target) {
  Element* const joint = system.joint(name);
  if (joint == nullptr) return;
  write_drive(*joint, mode, target);
  system.note(absl::StrCat("a drive of its joints by ", mode));
}

void joint_position(System& system) {
  const std::vector<std::string> names = system.texts({"joint_name"});
  if (names.empty()) return system.fail("it names no <joint_name>");
  const double target = system.number({"initial_position"}, 0);
  for (const std::string& name : names) {
    if (system.flag("use_velocity_commands", false)) {
      drive_joint(system, name, "position", target);
      continue;
    }
    const Gains gains{system.number({"p_gain"}, 1), system.number({"i_gain"}, 0.1),
                      system.number({"d_gain"}, 0.01), system.number({"i_max"}, 1),
                      system.number({"cmd_max"}, 1000)};
    write_pid(system, name, gains, false, target);
  }
}

void joint_velocity(System& system) {
  const std::vector<std::string> names = system.texts({"joint_name"});
  if (names.empty()) return system.fail("it names no <joint_name>");
  const double target = system.number({"initial_velocity"}, 0);
  for (const std::string& name : names) {
    if (!system.flag("use_force_commands", false)) {
      drive_joint(system, name, "velocity", target);
      continue;
    }
    const Gains gains{system.number({"p_gain"}, 1), system.number({"i_gain"}, 0), 0,
                      system.number({"i_max"}, 1), system.number({"cmd_max"}, 1000)};
    write_pid(system, name, gains, true, target);
  }
}

// The n-th number of a list that has one for each joint, or fewer.
double listed(System& system, const char* name, std::size_t n, double otherwise) {
  std::size_t place = 0;
  for (const Element* child = system.plugin().FirstChildElement(name); child != nullptr;
       child = child->NextSiblingElement(name), ++place) {
    if (place == n) {
      Numbers numbers;
      const double value = numbers.read(child, otherwise);
      if (!numbers.status().ok()) system.fail(numbers.status().message());
      return value;
    }
  }
  return otherwise;
}

void joint_trajectory(System& system) {
  const std::vector<std::string> names = system.texts({"joint_name"});
  if (names.empty()) return system.note("without a <joint_name>: it holds no joint");
  system.note("it holds its joints, and follows no trajectory by itself");
  for (std::size_t n = 0; n < names.size(); ++n) {
    const Gains gains{listed(system, "position_p_gain", n, 0), listed(system, "position_i_gain", n, 0),
                      listed(system, "position_d_gain", n, 0), listed(system, "position_i_max", n, 0),
                      listed(system, "position_cmd_max", n, 0)};
    write_pid(system, names[n], gains, false, listed(system, "initial_position", n, 0));
  }
}

// A robot in URDF has told which joints it commands, and got their drives.
void ros_control(System& system) {
  system.note("its joints stand until clients drive them; no controllers of ROS run");
}

// As SDF 1.11 has it in the axis.
void mimic(System& system) {
  Element* const follower = system.joint(system.text({"mimicJoint", "mimic_joint"}));
  Element* const leader = system.joint(system.text({"joint"}));
  if (follower == nullptr || leader == nullptr) return;
  Element* const axis = follower->FirstChildElement("axis");
  if (axis == nullptr) return system.fail("the joint that follows has no <axis>");
  if (axis->FirstChildElement("mimic") != nullptr) return;
  Element& entry = *axis->InsertNewChildElement("mimic");
  entry.SetAttribute("joint", system.name_of(*leader).c_str());
  xml::set_number(*entry.InsertNewChildElement("multiplier"), system.number({"multiplier"}, 1));
  xml::set_number(*entry.InsertNewChildElement("offset"), system.number({"offset"}, 0));
  system.note("a <mimic> of its joint");
}

// --- What is measured ---

// Where a sensor is that its model has as a plugin: in a link that it names, or else in the first one.
std::optional<ModelParts::Place> place_of_sensor(System& system) {
  const std::string name =
      system.text({"bodyName", "body_name", "linkName", "link_name", "frameName", "frame_name"});
  if (!name.empty()) return system.place(name);
  Element* const link = system.first_link();
  if (link == nullptr) return std::nullopt;
  return ModelParts::Place{link, {}};
}

void imu(System& system) {
  const std::optional<ModelParts::Place> place = place_of_sensor(system);
  if (!place) return;
  ProgramWriter program("imu", system.name());
  const double noise = std::abs(system.number({"gaussianNoise", "gaussian_noise"}, 0));
  program.set_place(place->pose).set_turn(place->pose).set("noise", noise).set("turn_noise", noise);
  system.write(program, *place->link);
}

void pose(System& system) {
  const std::optional<ModelParts::Place> place = place_of_sensor(system);
  if (!place) return;
  ProgramWriter program("pose", system.name());
  program.set("noise", std::abs(system.number({"gaussian_noise", "gaussianNoise"}, 0)));
  system.write(program, *place->link);
}

void sensor_without_noise(System& system, absl::string_view kind) {
  if (const std::optional<ModelParts::Place> place = place_of_sensor(system))
    system.write(ProgramWriter(kind, system.name()), *place->link);
}
void barometer(System& system) { sensor_without_noise(system, "barometer"); }
void magnetometer(System& system) { sensor_without_noise(system, "magnetometer"); }

// --- What flies and swims ---

void motor(System& system) {
  Element* const joint = system.joint(system.text({"jointName", "joint_name"}));
  if (joint == nullptr) return;
  Element* const rotor = system.side(*joint, "child");
  Element* const frame = system.side(*joint, "parent");
  if (rotor == nullptr || frame == nullptr) return;
  const double speed = system.number({"maxRotVelocity", "max_rot_velocity"}, 838);
  const double constant = system.number({"motorConstant", "motor_constant"}, 8.54858e-6);
  const double moment = system.number({"momentConstant", "moment_constant"}, 0.016);
  const std::string turning = system.text({"turningDirection", "turning_direction"});
  ProgramWriter program("thruster", system.name());
  // The rotor turns in Gazebo, and pushes along its joint; here it need not, and pushes along the z axis.
  program.set("rise", std::numbers::pi / 2)
      .set("force", constant * speed * speed)
      .set("reaction", turning == "cw" ? moment : -moment)
      .set("lag", system.number({"timeConstantUp", "time_constant_up"}, 1.0 / 80));
  system.write(program, *rotor);
  write_drive(*joint, "velocity", 0);
}

void propeller(System& system) {
  Element* const joint = system.joint(system.text({"joint_name"}));
  if (joint == nullptr) return;
  Element* const link = system.side(*joint, "child");
  if (link == nullptr) return;
  // It pushes along the axis of its joint.
  const Element* const xyz = find(joint, {"axis", "xyz"});
  const Element* const turned = joint->FirstChildElement("pose");
  const absl::StatusOr<Eigen::Vector3d> axis =
      xyz == nullptr ? Eigen::Vector3d(Eigen::Vector3d::UnitZ()) : xml::vector_in(*xyz, xml::text_of(*xyz));
  const absl::StatusOr<xml::RelativePose> pose =
      turned == nullptr ? xml::RelativePose{} : xml::pose_of(*turned);
  if (!axis.ok()) return system.fail(axis.status().message());
  if (!pose.ok()) return system.fail(pose.status().message());
  if (!pose->relative_to.empty() || (xyz != nullptr && xyz->Attribute("expressed_in") != nullptr))
    return system.fail("the axis of its joint must be along axes of its link");
  const Eigen::Vector3d way = pose->pose.orientation * *axis;
  ProgramWriter program("thruster", system.name());
  program.set_place({pose->pose.position, Eigen::Quaterniond::Identity()})
      .set("turn", portable::atan2(way.y(), way.x()))
      .set("rise", portable::atan2(way.z(), std::sqrt(way.x() * way.x() + way.y() * way.y())))
      .set("force", system.number({"max_thrust_cmd"}, 1000));
  system.write(program, *link);
}

void lift_drag(System& system) {
  const std::string name = system.text({"link_name"});
  const std::optional<ModelParts::Place> place = system.place(name);
  if (!place) return;
  const auto vector = [&](const char* child, const Eigen::Vector3d& otherwise) -> Eigen::Vector3d {
    const Element* const element = system.plugin().FirstChildElement(child);
    if (element == nullptr) return otherwise;
    const absl::StatusOr<Eigen::Vector3d> given = xml::vector_in(*element, xml::text_of(*element));
    if (given.ok()) return *given;
    system.fail(given.status().message());
    return otherwise;
  };
  const Eigen::Vector3d forward = vector("forward", Eigen::Vector3d::UnitX());
  const Eigen::Vector3d upward = vector("upward", Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d cp = vector("cp", Eigen::Vector3d::Zero());
  const Eigen::Vector3d across = upward.cross(forward);
  if (across.norm() == 0) return system.fail("<forward> and <upward> must have different directions");
  Pose pose{cp, {}};
  Eigen::Matrix3d axes;
  axes << forward.normalized(), across.normalized(), forward.cross(across).normalized();
  pose.orientation = Eigen::Quaterniond(axes);
  const Eigen::Vector3d angles = xml::angles_of(pose.orientation);
  // Gazebo's drag grows with the angle, and this one with its square: they are alike where it stalls.
  const double slope = system.number({"cla"}, 1);
  const double stall = std::abs(system.number({"alpha_stall"}, std::numbers::pi / 2));
  const double at_stall = slope * stall;
  const double drag = std::abs(system.number({"cda"}, 0.01)) * stall;
  ProgramWriter program("wing", system.name());
  program.set_place(pose)
      .set("roll", angles.x())
      .set("rise", -angles.y())
      .set("turn", angles.z())
      .set("area", system.number({"area"}, 1))
      .set("density", system.number({"air_density"}, 1.2041))
      .set("slope", slope)
      .set("zero_lift", -system.number({"a0", "alpha0"}, 0))
      .set("stall", std::min(stall, 1.5))
      .set("drag", at_stall == 0 ? drag : 0)
      .set("induced", at_stall == 0 ? 0 : drag / (at_stall * at_stall));
  system.write(program, *place->link);
}

// --- The table ---

struct Entry {
  absl::string_view name;           // as canonical_name() has it
  void (*take)(System&) = nullptr;  // none: it is left out
  absl::string_view why = "";       // what it would have done; empty: Tessera does it of itself
};
constexpr std::array kEntries = {
    Entry{"ackermann-steering", ackermann},
    Entry{"diff-drive", diff_drive},
    Entry{"diffdriveplugin", measured_drive},
    Entry{"gazebo-ros-diff-drive", diff_drive},
    Entry{"gazebo-ros-skid-steer-drive", diff_drive},
    Entry{"skidsteerdriveplugin", diff_drive},
    Entry{"joint-controller", joint_velocity},
    Entry{"joint-position-controller", joint_position},
    Entry{"joint-trajectory-controller", joint_trajectory},
    Entry{"gazebo-mimic-joint-plugin", mimic},
    Entry{"mimic-joint-plugin", mimic},
    Entry{"mimicjointplugin", mimic},
    Entry{"roboticsgroup-gazebo-mimic-joint-plugin", mimic},
    Entry{"roboticsgroup-upatras-gazebo-mimic-joint-plugin", mimic},
    Entry{"gazebo-ros-p3d", pose},
    Entry{"odometry-publisher", pose},
    Entry{"gazebo-groundtruth-plugin", pose},
    Entry{"gazebo-imu-plugin", imu},
    Entry{"gazebo-ros-imu", imu},
    Entry{"gazebo-barometer-plugin", barometer},
    Entry{"gazebo-magnetometer-plugin", magnetometer},
    Entry{"lift-drag", lift_drag},
    Entry{"liftdragplugin", lift_drag},
    Entry{"gazebo-motor-model", motor},
    Entry{"multicopter-motor-model", motor},
    Entry{"rotors-gazebo-motor-model", motor},
    Entry{"thruster", propeller},
    Entry{"gazebo-ros-control", ros_control},
    Entry{"gazebo-ros2-control", ros_control},
    Entry{"gz-ros2-control", ros_control},
    Entry{"ign-ros2-control", ros_control},
    // What Tessera does of itself: bodies and joints are there for all who ask, sensors measure, clients
    // command.
    Entry{"air-pressure"},
    Entry{"altimeter"},
    Entry{"contact"},
    Entry{"force-torque"},
    Entry{"forcetorque"},
    Entry{"gazebo-ros-factory"},
    Entry{"gazebo-ros-init"},
    Entry{"gazebo-ros-joint-state-publisher"},
    Entry{"gazebo-ros-state"},
    Entry{"imu"},
    Entry{"joint-state-publisher"},
    Entry{"label"},
    Entry{"magnetometer"},
    Entry{"navsat"},
    Entry{"nav-sat"},
    Entry{"physics"},
    Entry{"pose-publisher"},
    Entry{"scene-broadcaster"},
    Entry{"sensors"},
    Entry{"user-commands"},
    // What is known, and not done.
    Entry{"apply-joint-force", nullptr, "it would have pushed a joint"},
    Entry{"buoyancy", nullptr, "it would have let bodies float: see the program floater"},
    Entry{"camera-video-recorder", nullptr, "nothing is rendered"},
    Entry{"detachable-joint", nullptr, "it would have held two models together until it is told not to"},
    Entry{"gazebo-ros-camera", nullptr, "cameras are not rendered"},
    Entry{"gazebo-ros-openni-kinect", nullptr, "cameras are not rendered"},
    Entry{"gazebo-ros-planar-move", nullptr, "it would have moved its model by a velocity"},
    Entry{"hydrodynamics", nullptr, "it would have given a body the drag and inertia of water"},
    Entry{"mecanum-drive", nullptr, "it would have driven four mecanum wheels"},
    Entry{"planarmoveplugin", nullptr, "it would have moved its model by a velocity"},
    Entry{"tracked-vehicle", nullptr, "it would have driven tracks: see the program tracks"},
    Entry{"trajectory-follower", nullptr,
          "it would have taken its model along a path: see the program mover"},
    Entry{"triggered-publisher", nullptr, "it would have sent a message"},
    Entry{"velocity-control", nullptr, "it would have moved its model by a velocity"},
    Entry{"wind-effects", nullptr, "it would have been wind: see the program field"},
};

// "DiffDrive" as "diff-drive".
std::string in_words(absl::string_view camel) {
  std::string words;
  for (const char c : camel) {
    const bool is_upper = c >= 'A' && c <= 'Z';
    if (is_upper && !words.empty()) words += '-';
    words += absl::ascii_tolower(static_cast<unsigned char>(c));
  }
  return words;
}

// What comes after a prefix such as "gz-sim8-".
bool strip_release(absl::string_view prefix, std::string& name) {
  absl::string_view rest = name;
  if (!absl::ConsumePrefix(&rest, prefix)) return false;
  while (!rest.empty() && absl::ascii_isdigit(static_cast<unsigned char>(rest.front())))
    rest.remove_prefix(1);
  if (!absl::ConsumePrefix(&rest, "-")) return false;
  name = std::string(rest);
  return true;
}

const Entry* find_entry(const Element& plugin) {
  const std::string name = canonical_name(plugin);
  const auto found = std::ranges::find(kEntries, absl::string_view(name), &Entry::name);
  return found == kEntries.end() ? nullptr : &*found;
}

}  // namespace

std::string canonical_name(const Element& plugin) {
  const char* const file = plugin.Attribute("filename");
  const char* const name = plugin.Attribute("name");
  if (file == nullptr || *file == '\0') {
    const absl::string_view full = name == nullptr ? "" : name;
    const std::size_t colons = full.rfind("::");
    return colons == absl::string_view::npos ? "" : in_words(full.substr(colons + 2));
  }
  absl::string_view base = file;
  if (const std::size_t slash = base.rfind('/'); slash != absl::string_view::npos)
    base = base.substr(slash + 1);
  absl::ConsumeSuffix(&base, ".so");
  absl::ConsumePrefix(&base, "lib");
  std::string result = absl::AsciiStrToLower(absl::StrReplaceAll(base, {{"_", "-"}}));
  strip_release("gz-sim", result) || strip_release("ignition-gazebo", result);
  return std::string(absl::StripSuffix(result, "-system"));
}

void write_drive(Element& joint, const char* mode, double target) {
  if (joint.FirstChildElement("tessera:drive") != nullptr) return;
  Element& drive = *joint.InsertNewChildElement("tessera:drive");
  drive.SetAttribute("mode", mode);
  drive.SetAttribute("target", target);
}

std::string skipped(const Element& plugin) {
  const char* const file = plugin.Attribute("filename");
  const std::string title = file == nullptr ? "<plugin>" : absl::StrCat("<plugin> ", file);
  const Entry* const entry = find_entry(plugin);
  if (entry == nullptr) return absl::StrCat(title, " skipped");
  if (entry->take != nullptr) return absl::StrCat(title, " skipped: it belongs in a <model>");
  return entry->why.empty() ? "" : absl::StrCat(title, " skipped: ", entry->why);
}

void take_systems(const ModelParts& parts, Notices& notices) {
  Element& model = parts.model();
  while (Element* const plugin = model.FirstChildElement("plugin")) {
    const Entry* const entry = find_entry(*plugin);
    if (entry != nullptr && entry->take != nullptr) {
      System system(*plugin, parts, notices);
      entry->take(system);
      system.finish();
    } else if (const std::string text = skipped(*plugin); !text.empty()) {
      notices.count(text);
    }
    model.DeleteChild(plugin);
  }
}

}  // namespace tessera::gazebo
