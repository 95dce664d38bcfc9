// Joints that a URDF robot offers to ros_control and ros2_control.
#pragma once

#include <map>
#include <string>

#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera::gazebo {

// How a joint is commanded, and where it starts.
struct CommandedJoint {
  std::string interface;  // "position", "velocity" or "effort"
  double initial = 0;     // rad or m
};
using CommandedJoints = std::map<std::string, CommandedJoint>;

// Those of the <transmission> and <ros2_control> elements of a <robot>, which are removed. What cannot be
// read is left out, with a notice.
CommandedJoints take_commanded_joints(xml::Element& robot, Notices& notices);

// Whether a <plugin> hands joints to controllers of ROS.
bool is_ros_control(const xml::Element& plugin);

// Until somebody commands them, joints of a <model> hold their positions, or stand, by drives that clients
// can change. Those that follow others, and those that are commanded by effort, are left as they are.
void hold(const CommandedJoints& joints, xml::Element& model);

}  // namespace tessera::gazebo
