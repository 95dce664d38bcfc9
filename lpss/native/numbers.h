// What the arrays of islands have of bodies and contacts of a sector's world, and what comes back. Also as
// bytes, for a solver elsewhere.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>

#include "lpss/islands/contact_needs.h"
#include "lpss/islands/islands.h"
#include "lpss/islands/step_solver.h"
#include "lpss/native/body.h"
#include "lpss/native/contact.h"

namespace tessera::native {

using Numbers = Islands<Scalar>;

// In ticks of `dt` seconds.
inline void fill(const Body& body, double dt, Numbers::Body& into) {
  into.linear = body.linear;
  into.angular = body.angular;
  into.linear_force = body.linear_push(Scalar(dt));
  into.angular_force = body.angular_push(Scalar(dt));
  into.inverse_mass = body.inverse_mass;
  into.inverse_inertia = body.inverse_inertia();
}
Numbers::Frame frame_of(const Body& body);

// The body then moves on by the velocities that it ends with. One that would be corrected to nowhere, or
// farther than any body goes, stays, and has diverged: its velocities say why.
void take(const Numbers::Solved& solved, double dt, Body& body);

// What is known of a contact before its patches are looked at.
struct ContactHead {
  // A body that cannot be pushed has velocities if it is kinematic.
  enum class Side : std::uint8_t { kPushed, kStill, kMoving };

  std::uint32_t patches = 0;
  std::array<Side, 2> sides = {Side::kPushed, Side::kPushed};
  std::array<Vector, 2> linear;   // m/s, of moving sides only
  std::array<Vector, 2> angular;  // rad/s
  Scalar extent = 0;              // m; see ContactScale
  Scalar nimbleness = 1;          // likewise
  bool may_bounce = false;
  bool is_deep = false;  // deeper than any load presses a body in: it does not rest there
  bool carries = false;  // on a surface that moves
  bool has_surfaces = false;
  bool has_course = false;
};

// A contact with its bodies, as their world has them: a.id < b.id.
struct ContactView {
  const Contact* contact;
  const Body* a;
  const Body* b;
};

void look_at(const ContactView& view, ContactHead& head);

// A patch of it, but for the places of its bodies: gaps are not below `gap_min`. `surface` and `course` are
// where the patch may keep what it refers to.
void fill(const ContactView& view, std::size_t patch, double dt, Scalar gap_min, Numbers::Patch& into,
          Numbers::Surface* surface, Numbers::Course* course);

// Takes the impulses of the patches of a contact of a and b, or forgets those that no tick may start from.
// `usual`: of the usual steps.
void take(std::span<const Numbers::Patch> patches, const ContactNeeds& needs, const Opening<Scalar>& usual,
          const Body& a, const Body& b, Contact& contact);

// Inverse mass, extent and nimbleness.
inline ContactScale scale_of(const Body& a, const Body& b) {
  ContactScale scale;
  scale.inverse_mass = double(std::max(a.inverse_mass * a.nimbleness, b.inverse_mass * b.nimbleness));
  scale.nimbleness = double(std::max(a.nimbleness, b.nimbleness));
  scale.extent = std::numeric_limits<double>::max();
  for (const Body* body : {&a, &b}) {
    if (body->is_dynamic()) scale.extent = std::min(scale.extent, double(body->solid->extent()));
  }
  return scale;
}

// --- as bytes ---

void append(const Numbers::Body& body, const Numbers::Frame& frame, std::string& bytes);
void append(const ContactView& view, double dt, std::string& bytes);
void append(const Numbers::Solved& solved, std::string& bytes);
void append_impulses(const Numbers::Patch& patch, std::string& bytes);

// They take from the front of `bytes`; false if there is something else.
[[nodiscard]] bool read(std::string_view& bytes, Numbers::Body& body, Numbers::Frame& frame);
[[nodiscard]] bool read(std::string_view& bytes, ContactHead& head);
// As fill(), of a contact with this head.
[[nodiscard]] bool read(std::string_view& bytes, const ContactHead& head, Scalar gap_min,
                        Numbers::Patch& patch, Numbers::Surface* surface, Numbers::Course* course);
[[nodiscard]] bool read(std::string_view& bytes, Numbers::Solved& solved);
// Of a patch with so many points. Its surface is there if it has one.
[[nodiscard]] bool read_impulses(std::string_view& bytes, Numbers::Patch& patch);

}  // namespace tessera::native
