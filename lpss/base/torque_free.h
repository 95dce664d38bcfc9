// The rotation of a rigid body on which no torque acts.
#pragma once

#include <Eigen/Core>

namespace tessera {

struct Spin {
  Eigen::Matrix3d axes;  // the principal axes of inertia, as columns
  Eigen::Vector3d rate;  // rad/s, in the frame that the columns are given in
};

// After `dt` seconds, for moments of inertia > 0 in kg m^2. Angular momentum is kept to the last digits, and
// energy within 0.1 % up to some 5,000 rad/s at 60 ticks per second, for as long as the body spins.
//
// The energy is split into parts whose motions are known rotations (Touma and Wisdom, "Lie-Poisson
// integrators for rigid body dynamics in the solar system", 1994): with the middle moment about all axes, a
// body turns about its angular momentum; what the two other moments add are turns about their axes. The steps
// are symmetric in time, and the faster the spin, the more of them; they are exact if two moments are equal.
Spin torque_free(const Spin& spin, const Eigen::Vector3d& moments, double dt);

// Steps of `dt` seconds with a constant rate (rad/s) in each: the discrete Euler equations (Moser and
// Veselov, "Discrete versions of some classical integrable systems", 1991). With the inertia I (kg m^2) at
// the start of a step, in the frame of the rates, the angular momentum in the middle of the step is
//
//   exp(rate dt / 2) I rate = exp(-last dt / 2) I last + dt torque
//
// where `last` is the rate of the step before. These keep angular momentum, and energy within a bound that
// shrinks with dt^2, however long the body turns. A step in which it turns by more than 0.7 rad counts as
// one of 0.7 rad.

// By how much more I rate is than the angular momentum in the middle of the step: N m s. `turning` is the
// rate at which the body's inertia turns: that of the body, but for a rotor (below).
Eigen::Vector3d momentum_beyond_middle(const Eigen::Matrix3d& inertia, const Eigen::Vector3d& rate,
                                       const Eigen::Vector3d& turning, double dt);

struct SteppedRate {
  Eigen::Vector3d rate;           // rad/s
  Eigen::Vector3d beyond_middle;  // N m s, that the rate was found with
};

// The rate of the next step, were there no torque: nearly, as one comes nearer by adding to it what
// momentum_beyond_middle() has grown by. Where a step turns the body farther than 0.1 rad, energy is kept
// exactly.
SteppedRate next_rate(const Eigen::Matrix3d& inertia, const Eigen::Matrix3d& inverse_inertia,
                      const Eigen::Vector3d& last, double dt);

// The same of a body that is symmetric about `axis` (of unit length, at the start of the step), and whose
// rate in a step is a constant one across the axis and one about it, wherever it then points. The former
// alone turns its inertia, so that the latter may be as high as it likes. Solved exactly: energy is kept, and
// a step that is longer than a nutation damps nothing. `last` points along the axis as it is now, too.
SteppedRate next_rate_of_rotor(const Eigen::Matrix3d& inertia, const Eigen::Vector3d& axis,
                               const Eigen::Vector3d& last, double dt);

}  // namespace tessera
