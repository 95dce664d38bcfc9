// Controllers of joints.
#include <absl/strings/str_cat.h>

#include <cstddef>
#include <string>
#include <vector>

#include "worlds/gazebo/system_kinds.h"

namespace tessera::gazebo {
namespace {

using xml::Element;

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

}  // namespace

void take_joint_position(System& system) {
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

void take_joint_velocity(System& system) {
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

void take_joint_trajectory(System& system) {
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
void take_ros_control(System& system) {
  system.note("its joints stand until clients drive them; no controllers of ROS run");
}

// As SDF 1.11 has it in the axis.
void take_mimic(System& system) {
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

}  // namespace tessera::gazebo
