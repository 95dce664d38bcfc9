// Masses for links that have none, but that joints move.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace tessera {

struct LinkMass {
  double mass = 0;    // kg; 0: none
  double moment = 0;  // the mean of the principal moments, kg m^2
};

// Gives each link without mass kLeastMassShare of the mass and of the moment of the nearest link that has
// one, along `joints` (pairs of places in `links`): little enough to move as if it had none, and enough to be
// divided by. Without any such link it is SDF's default, 1 kg and 1 kg m^2.
inline constexpr double kLeastMassShare = 0.01;
void give_least_masses(std::vector<LinkMass>& links,
                       const std::vector<std::pair<std::size_t, std::size_t>>& joints);

}  // namespace tessera
