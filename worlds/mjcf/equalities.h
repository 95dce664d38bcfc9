// Equality constraints of MuJoCo as joints, and as axes that follow others.
#pragma once

#include <map>

#include "lpss/model/world_description.h"
#include "worlds/loader/notices.h"
#include "worlds/mjcf/model.h"
#include "worlds/mjcf/names.h"
#include "worlds/mjcf/sensors.h"

namespace tessera::mjcf {

// Where a hinge or slide of MuJoCo is among the joints of a world.
struct AxisPlace {
  std::size_t joint = 0;
  std::size_t axis = 0;
};
using AxisPlaces = std::map<int, AxisPlace>;

// Adds those that are active: a weld is a fixed joint, a connect a ball joint, and a joint whose polynomial
// is a line follows the other one. `bodies`: where MuJoCo's bodies are.
void add_equalities(const mjModel& model, const SensorBodies& bodies, const AxisPlaces& axes, Names& names,
                    WorldDescription& world, Notices& notices);

}  // namespace tessera::mjcf
