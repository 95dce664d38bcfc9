#include "worlds/gazebo/ros_control.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/string_view.h>

#include "worlds/gazebo/model_parts.h"
#include "worlds/gazebo/numbers.h"
#include "worlds/gazebo/systems.h"

namespace tessera::gazebo {
namespace {

using xml::Element;

// "hardware_interface/PositionJointInterface" as "position"; empty for others.
std::string interface_of(absl::string_view text) {
  const std::string lower = absl::AsciiStrToLower(text);
  for (const char* interface : {"position", "velocity", "effort"}) {
    if (absl::StrContains(lower, interface)) return interface;
  }
  return "";
}

void take_transmission(const Element& transmission, CommandedJoints& joints) {
  const Element* const joint = transmission.FirstChildElement("joint");
  const std::string name = xml::attribute_of(joint, "name");
  const std::string interface =
      joint == nullptr ? "" : interface_of(xml::child_text(*joint, "hardwareInterface"));
  if (!name.empty() && !interface.empty()) joints.try_emplace(name, CommandedJoint{interface});
}

void take_ros2_control(const Element& control, CommandedJoints& joints, Notices& notices) {
  for (const Element* joint = control.FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    CommandedJoint commanded{
        interface_of(xml::attribute_of(joint->FirstChildElement("command_interface"), "name"))};
    if (commanded.interface.empty()) continue;
    for (const Element* state = joint->FirstChildElement("state_interface"); state != nullptr;
         state = state->NextSiblingElement("state_interface")) {
      const Element* const param = state->FirstChildElement("param");
      if (xml::attribute_of(state, "name") != "position" ||
          xml::attribute_of(param, "name") != "initial_value")
        continue;
      Numbers numbers;
      commanded.initial = numbers.read(param, 0);
      if (!numbers.status().ok())
        notices.count_repair("initial_value that is no number, taken as 0", xml::place_of(*param));
    }
    joints.try_emplace(xml::attribute_of(joint, "name"), commanded);
  }
}

}  // namespace

CommandedJoints take_commanded_joints(Element& robot, Notices& notices) {
  CommandedJoints joints;
  while (Element* const transmission = robot.FirstChildElement("transmission")) {
    take_transmission(*transmission, joints);
    robot.DeleteChild(transmission);
  }
  while (Element* const control = robot.FirstChildElement("ros2_control")) {
    take_ros2_control(*control, joints, notices);
    robot.DeleteChild(control);
  }
  return joints;
}

bool is_ros_control(const Element& plugin) {
  const std::string name = canonical_name(plugin);
  return name == "gazebo-ros-control" || name == "gazebo-ros2-control" || name == "gz-ros2-control" ||
         name == "ign-ros2-control";
}

void hold(const CommandedJoints& joints, Element& model) {
  const ModelParts parts(model);
  for (const auto& [name, commanded] : joints) {
    Element* const joint = parts.joint(name);
    const Element* const axis = joint == nullptr ? nullptr : joint->FirstChildElement("axis");
    if (axis == nullptr || axis->FirstChildElement("mimic") != nullptr) continue;
    if (commanded.interface == "position") write_drive(*joint, "position", commanded.initial);
    if (commanded.interface == "velocity") write_drive(*joint, "velocity", 0);
  }
}

}  // namespace tessera::gazebo
