// What surfaces do to what touches them: of bodies, of their parts, and of two that touch.
#pragma once

#include <cstdint>
#include <optional>

#include "lpss/native/math.h"

namespace tessera::native {

// The surface of a body, if it has one of its own: see Surface. In the centre frame; in the world's axes if
// the body is static. In the frame of the part for that of a part, which does not move.
struct BodySurface {
  Vector direction;  // of unit length, or 0
  Scalar second_friction;
  Scalar torsional_friction;
  Scalar patch_radius;
  Scalar rolling_friction;
  Vector velocity;
  Vector running;
};

// What a part of a body has in the place of the body's own: see tessera::PartMaterial.
struct Material {
  Scalar friction;
  Scalar restitution;
  std::uint32_t category;
  std::uint32_t mask;
  std::optional<BodySurface> surface;
};

// What a contact has of surfaces of their own (Surface), since a solver elsewhere may not know the bodies.
// World axes.
struct ContactSurface {
  Vector direction = Vector::Zero();  // of unit length, or 0
  Scalar along = 1;                   // shares of the contact's friction
  Scalar across = 1;
  Scalar torsion = 0;  // m
  Scalar rolling = 0;  // m
  // m/s: with a normal n from b to a, the surface of a moves past that of b by velocity - running x n, beyond
  // how the bodies move.
  Vector velocity = Vector::Zero();
  Vector running = Vector::Zero();

  bool moves() const { return !velocity.isZero(0) || !running.isZero(0); }
  friend bool operator==(const ContactSurface&, const ContactSurface&) = default;
};

// What two surfaces that touch have together.
struct ContactMaterial {
  Scalar friction = 0;
  Scalar restitution = 0;
  std::optional<ContactSurface> surface;  // none: two usual ones

  friend bool operator==(const ContactMaterial&, const ContactMaterial&) = default;
};

}  // namespace tessera::native
