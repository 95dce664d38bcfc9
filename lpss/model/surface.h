// How the surface of a body holds and carries what touches it, beyond a single coefficient of friction.
#pragma once

#include <array>

namespace tessera {

// Vectors are in the body frame. The defaults are those of a body whose surface is like any other.
struct Surface {
  // Where not 0: `friction` acts along this direction (its part along the contact), `second_friction` across
  // it, and what slides at an angle is held within the ellipse of the two. A contact has the smaller
  // coefficients of its two bodies, and the direction of the one that has one (the lower id, if both do).
  std::array<double, 3> direction{};
  double second_friction = 0;  // Coulomb coefficient; of no meaning without a direction

  // A contact patch of this radius resists spinning by 3 pi / 16 torsional_friction patch_radius times the
  // normal force, beyond what points of contact that are apart resist. A contact has the smaller coefficient
  // and the larger radius of its two bodies.
  double torsional_friction = 1;
  double patch_radius = 0;  // m

  // m: the torque that resists rolling, by the normal force. A contact has the larger one of its two bodies.
  double rolling_friction = 0;

  // How the surface moves while the body stays: a conveyor belt. Friction aims at this velocity.
  std::array<double, 3> velocity{};  // m/s, the same everywhere
  // m/s: with a normal n that points out, the surface moves by running x n. A track runs around this axis:
  // forwards above, backwards below.
  std::array<double, 3> running{};

  friend bool operator==(const Surface&, const Surface&) = default;
};

}  // namespace tessera
