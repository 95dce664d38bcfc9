// Actuators of MuJoCo as drives of joints.
#pragma once

#include <map>

#include "lpss/model/joint.h"
#include "worlds/loader/notices.h"
#include "worlds/mjcf/model.h"

namespace tessera::mjcf {

struct AxisDrive {
  JointDrive drive;
  double effort_max = kUnbounded;
};

// The drives of hinges and slides, by MuJoCo's joint. All actuators of a joint that push it by an effort
// that is affine in its position and velocity are one drive: a servo, or an effort where there is no gain.
// `controls` are those at the start.
std::map<int, AxisDrive> drives_of(const Model& model, const mjtNum* controls, Notices& notices);

}  // namespace tessera::mjcf
