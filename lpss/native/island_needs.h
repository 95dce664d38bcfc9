// How hard an island is to solve, determined by its contents alone.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace tessera::native {

// Two bodies that touch, or a body that touches the ground; indices into a list of bodies.
struct ContactEdge {
  static constexpr std::size_t kGround = ~std::size_t{0};
  std::size_t a = kGround;
  std::size_t b = kGround;
};

// The load ratio of each body: the weight that it carries relative to its own. A body carries its neighbours
// that are more contacts away from the ground; their weight is divided evenly among the bodies that they lie
// on. 0 without a connection to the ground. An impulse propagates by one contact per pass, and is attenuated
// by this ratio: the lowest of a tower of ten equal boxes has 9, and a box of 1 kg under one of 1000 kg has
// 1000. The result for a body depends on its island alone.
std::vector<double> load_ratios(std::span<const double> masses, std::span<const ContactEdge> touches);

// A load ratio for a tick in which forces alone move a body by `fall` (m): the error of a substep grows with
// it. On Earth, at 60 ticks a second or more, the ratio itself.
double load_in_tick(double load_ratio, double fall);

// The number of substeps for an island with this largest load ratio; `usual` (>= 2) is the number in the
// settings.
int steps_for(double load_ratio, int usual);

// The number of substeps for jointed bodies that turn by this angle in a tick, rad.
int steps_for_turn(double turn, int usual);

}  // namespace tessera::native
