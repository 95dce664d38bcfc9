// Worlds in MuJoCo's own words.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "lpss/model/world_description.h"

namespace tessera {

struct MujocoOptions {
  int steps = 8;            // in a tick; of 1/60 s, they are about as long as MuJoCo's own 2 ms
  bool is_elliptic = true;  // the cone of friction; otherwise a pyramid of four edges, MuJoCo's default
  // In all velocities; otherwise in the damping of joints alone: "Euler", its default.
  bool is_implicit = false;
};

// MuJoCo's XML for bodies, fixed, revolute, prismatic and universal joints, springs, dampers and limits of
// the world, with MuJoCo's defaults but for `options`. A servo is an actuator of its stiffness, and damping
// of the joint. It knows no restitution, and no bounds of efforts. UNIMPLEMENTED for what it has no words
// for.
absl::StatusOr<std::string> mjcf_of(const WorldDescription& world, const MujocoOptions& options);

// Names in it. Two axes of a universal joint are two joints.
std::string mjcf_body(BodyId id);
std::string mjcf_joint(BodyId child, int axis = 0);
std::string mjcf_servo(BodyId child, int axis = 0);

}  // namespace tessera
