// How hard an island is to solve, from what is in it alone.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace tessera::bullet {

// Two bodies that touch, or one and what does not move; places in a list of bodies.
struct Touch {
  static constexpr std::size_t kGround = ~std::size_t{0};
  std::size_t a = kGround;
  std::size_t b = kGround;
};

// The weight that each body carries, by its own: what lies on it is what is farther from the ground by number
// of contacts, shared out evenly among those that it lies on. 0 for what has no way to the ground. A row of
// impulses travels one contact a pass, and loses by this ratio on its way: a tower of ten equal boxes has 9
// in its lowest, and a box of 1 kg under one of 1000 kg has 1000. What comes out for a body depends on its
// island alone.
std::vector<double> burdens(std::span<const double> masses, std::span<const Touch> touches);

// The small steps of a tick that an island with this largest burden needs, where `usual` (>= 2) are the
// settings'.
int steps_for(double burden, int usual);

// Likewise where what joints hold turns by so much in a tick, rad.
int steps_for_turn(double turn, int usual);

}  // namespace tessera::bullet
