// Robots as data: links, and hinges with servos.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "lpss/model/world_description.h"
#include "lpss/tick/messages.h"

namespace tessera::robots {

// A link in the frame of its robot, whose z is up: at rest, with all joints at their zero.
struct Link {
  std::string name;
  Pose pose;  // of its centre of mass; its axes are the principal ones
  std::vector<ShapePart> parts;
  double mass = 1;                         // kg
  std::array<double, 3> inertia{1, 1, 1};  // kg m^2
};

struct Hinge {
  double lower = 0;      // rad
  double upper = 0;      // rad
  double stiffness = 0;  // N m/rad, of its servo
  double damping = 0;    // N m s/rad
  double middle = 0;     // rad, of its targets
  double swing = 0;      // rad: they move by so much to both sides
};

// One hinge, or two whose axes cross: those of the frame, x and y.
struct RobotJoint {
  std::size_t parent = 0;  // places among the links
  std::size_t child = 0;
  Pose frame;  // of the robot
  std::vector<Hinge> hinges;
};

struct Robot {
  std::string name;
  double apart = 3;         // m, from one to the next
  double height = 1;        // m, of its frame's origin at the start
  std::vector<Link> links;  // the trunk first, each after what it hangs on
  std::vector<RobotJoint> joints;
};

// A ball with four legs of two capsules: eight hinges.
Robot ant();
// Head, chest, waist, pelvis, arms and legs of 1.5 m: 21 hinges.
Robot humanoid();

std::size_t hinges_of(const Robot& robot);

// `count` of them in a square, on a plane. They touch the plane alone. Bodies and joints are in the order of
// robots.
WorldDescription robots_on_plane(const WorldSettings& settings, const Robot& robot, int count);

// The targets of servos for the tick that begins at `time` (s), of robots with the numbers `first` and
// following: each swings at 1 Hz, every hinge and robot in a phase of its own. The first joint has the id 1.
std::vector<Command> servo_targets(const Robot& robot, int first, int count, double time);

// One that was thrown, whose hinges turn freely, without gravity, ground, servos or limits: energy and
// momentum stay. Each `number` moves in another way.
WorldDescription robot_in_space(const WorldSettings& settings, const Robot& robot, int number);

}  // namespace tessera::robots
