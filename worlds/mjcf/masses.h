// Masses of bodies, as MuJoCo has computed them.
#pragma once

#include <utility>
#include <vector>

#include "lpss/model/body.h"
#include "worlds/loader/notices.h"
#include "worlds/mjcf/model.h"

namespace tessera::mjcf {

// MuJoCo's bodies that one of ours is made of, with their poses in its frame.
using Members = std::vector<std::pair<int, Pose>>;

// Sets mass, moments, centre of mass and principal axes to this share of those of all members together. What
// no body has is mended.
void set_mass(const Model& model, const Members& members, double share, BodyProperties& properties,
              Notices& notices);

}  // namespace tessera::mjcf
