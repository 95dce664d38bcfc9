// Crowds on a plane, in sectors of 32 m.
#pragma once

#include <Eigen/Core>

#include "lpss/simulation/example_programs.h"

namespace tessera {

inline constexpr int kPeople = 500;

// Nothing but the plane.
WorldBuilder plane(Precision precision);

// The n-th place of a square of `count`, so far apart and so high above the plane (m).
Eigen::Vector3d place_in_square(int n, int count, double apart, double height);

// Characters of ids 2 and so on, with these inputs.
WorldDescription people_on_plane(Precision precision, const ProgramNumbers& inputs);

// The same, each of which walks from goal to goal without a pause.
WorldDescription wanderers_on_plane(Precision precision);

}  // namespace tessera
