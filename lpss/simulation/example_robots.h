// Robots on wheels that joints hold, for tests and experiments.
#pragma once

#include <Eigen/Core>
#include <string>

#include "lpss/simulation/example_programs.h"

namespace tessera {

// How wheels touch the ground: in a point, or along a line.
enum class Tread { kBall, kCylinder };

struct RobotSize {
  double radius = 0;     // m, of a wheel
  double track = 0;      // m, from left to right
  double wheelbase = 0;  // m, from rear to front
};

inline constexpr RobotSize kExampleRobot{0.1, 0.5, 0};
inline constexpr RobotSize kExampleRover{0.12, 0.5, 0.8};

// The id that the joint of this name will have, as a number of a program.
double joint_number(const WorldBuilder& builder, const std::string& name);

// The body `name` on two wheels that a `diff_drive` drives, and balls before and behind that slide; `place`
// is on the ground in its middle.
void add_robot(WorldBuilder& builder, const std::string& name, Tread tread, const Eigen::Vector3d& place,
               const ProgramNumbers& numbers = {});

// The body `name` on four wheels, of which an `ackermann` drives the rear ones and steers the front ones:
// `name_left_knuckle` and `name_right_knuckle`.
void add_rover(WorldBuilder& builder, const std::string& name, Tread tread, const Eigen::Vector3d& place,
               const ProgramNumbers& numbers = {});

}  // namespace tessera
