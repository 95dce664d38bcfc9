// The contact of two bodies, as it lives from tick to tick.
#pragma once

#include <absl/container/inlined_vector.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "lpss/islands/contact_needs.h"
#include "lpss/native/material.h"
#include "lpss/native/math.h"
#include "lpss/solver/contact_solver.h"

namespace tessera::native {

struct ContactPoint {
  Vector on_a;  // m, in the centre frames of the bodies
  Vector on_b;
  Scalar gap = 0;      // m, < 0 where they overlap
  Scalar impulse = 0;  // N s, along the normal, in the last solution
  std::uint32_t feature = 0;
};

// Points that share a normal and friction.
struct ContactPatch {
  std::uint64_t parts = 0;  // what touches: parts of compounds, triangles of surfaces
  Vector normal;            // unit, from b to a, world axes
  // The same in the frame of the body that it is fixed to; 0 if it is predicted.
  Vector fixed_normal = Vector::Zero();
  bool is_fixed_to_a = false;
  bool is_predicted = false;  // from a sweep: lives for one tick
  std::uint8_t count = 0;
  Vector friction_impulse = Vector::Zero();  // N s, on a, in the last solution
  Scalar twist_impulse = 0;                  // N m s
  Vector rolling_impulse = Vector::Zero();   // N m s, on a, in the last solution
  ContactPoint point[kPatchPointsMax];

  bool is_touching() const;
};

// Of bodies a and b, a.id < b.id.
struct Contact {
  absl::InlinedVector<ContactPatch, 1> patches;  // ascending by parts
  Scalar friction = 0;
  Scalar restitution = 0;  // of patches with materials of their own, the largest one

  // b relative to a, in a's frame, when the points were found. Until it has moved by more than half the
  // distance at which contacts are found, nothing else can touch, and the points are only moved along.
  bool is_found = false;
  Frame found_at;

  ContactNeed need;

  std::shared_ptr<const ContactSurface> surface;  // none: two usual ones

  // Of the patches, in their order, where parts of the bodies have materials of their own; none for patches
  // beyond, which have what is above.
  std::shared_ptr<const std::vector<ContactMaterial>> materials;

  // Of a patch.
  const ContactMaterial* material_of(std::size_t patch) const {
    return materials && patch < materials->size() ? &(*materials)[patch] : nullptr;
  }
  const ContactSurface* surface_of(std::size_t patch) const {
    const ContactMaterial* const own = material_of(patch);
    if (!own) return surface.get();
    return own->surface ? &*own->surface : nullptr;
  }
  bool has_surfaces() const { return surface || materials; }

  bool is_touching() const;
  bool is_predicted() const { return !patches.empty() && patches.back().is_predicted; }
};

// Removes the patches of sweeps, which come last.
void drop_predicted(Contact& contact);

// Forgets what it bore: the next tick starts as if the contact had just begun.
void drop_impulses(Contact& contact);

// All that is along the world's axes, along others.
void turn_contact(const Matrix& turn, Contact& contact);

// Equal contacts give equal bytes. decode() returns false if the bytes are not output of encode() in this
// precision.
std::string encode(const Contact& contact);
bool decode(std::string_view bytes, Contact& contact);

}  // namespace tessera::native
