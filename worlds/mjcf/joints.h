// Joints of MuJoCo as joints of ours.
#pragma once

#include <absl/status/status.h>

#include <vector>

#include "lpss/model/joint.h"
#include "worlds/loader/notices.h"
#include "worlds/mjcf/model.h"

namespace tessera::mjcf {

// One joint of ours on the way from a body to its parent, and what it stands for: a ball, a hinge, a slide,
// or two hinges at right angles through one point, which are a universal joint. A body with several has as
// many links before it, less one.
struct Hop {
  JointType type = JointType::kFixed;
  std::vector<int> joints;  // of MuJoCo, one for each axis
};
std::vector<Hop> hops_of(const mjModel& model, int body);

// Coordinates of ours are those of MuJoCo less this: whole turns, where limits are beyond half a turn.
double turns_of(const mjModel& model, int joint);

// The joint without bodies and drives. Both frames are in the frame of the body, as it is in the parent
// where MuJoCo's model has it.
JointProperties joint_of(const mjModel& model, const Hop& hop, Notices& notices);

// Where these coordinates and velocities of all joints have it.
JointPlace place_of(const mjModel& model, const Hop& hop, const mjtNum* positions, const mjtNum* velocities);

// Of a joint that hangs on no body: its frame on the parent, which is in the world, is given to a sector.
absl::Status anchor(JointProperties& joint, double sector_size);

}  // namespace tessera::mjcf
