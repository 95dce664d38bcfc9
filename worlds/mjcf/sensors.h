// Sensors of MuJoCo as programs.
#pragma once

#include <vector>

#include "lpss/model/world_description.h"
#include "worlds/loader/notices.h"
#include "worlds/mjcf/model.h"

namespace tessera::mjcf {

// Where something of MuJoCo is in a world of ours.
struct Place {
  std::size_t body = 0;   // its place in the bodies
  Pose pose;              // of the frame of MuJoCo's body in that of ours
  std::size_t joint = 0;  // that holds it to its parent: its place in the joints plus one; 0: none
};

// Gives bodies that can move the programs of the sensors at their sites. `places` are those of MuJoCo's
// bodies; a body below 0 that has none of ours.
struct SensorBodies {
  std::vector<Place> places;
  std::vector<bool> moves;  // whether programs can be there
};
void add_sensors(const Model& model, const SensorBodies& bodies, WorldDescription& world, Notices& notices);

}  // namespace tessera::mjcf
