// Finds the contact points of two bodies.
//
// Balls, capsules, boxes, hulls and triangles by the closed forms of lpss/collision; other convex shapes by
// round_shapes.h. Impulses of the last tick stay with the features that touch.
#pragma once

#include <vector>

#include "lpss/native/body.h"
#include "lpss/native/contact.h"

namespace tessera::native {

// For one thread at a time.
class NarrowPhase {
 public:
  // False of pairs that are apart, where that is easily seen: update() would find no points.
  static bool may_touch(const Body& a, const Body& b);

  // Brings the points of a pair (a.id < b.id) up to date with its bodies. Whether they were found anew.
  bool update(const Body& a, const Body& b, Contact& contact);

  // The points of a pair that are within `margin` (m), of no history: `contact` has these alone.
  void look(const Body& a, const Body& b, Scalar margin, Contact& contact);

  // m, between the surfaces of two solids; <= 0 if they overlap, larger than `reach` if they are farther
  // apart.
  static Scalar distance(const Solid& p, const Frame& p_at, const Solid& q, const Frame& q_at, Scalar reach);

 private:
  bool move_along(const Body& a, const Body& b, const Frame& seen, Scalar margin, Contact& contact) const;
  void find(const Body& a, const Body& b, const Contact& before, Scalar margin);
  void find(const Body& a, const Part& p, const Body& b, const Part& q, std::uint64_t parts,
            const Contact& before, Scalar margin);
  void find_on_planet(const Body& body, const Part& part, const Body& planet, const Part& ball,
                      std::uint64_t parts, Scalar margin);
  void inherit(const Contact& before);

  std::vector<ContactPatch> found_;
  std::vector<std::uint32_t> parts_of_a_;
  std::vector<std::uint32_t> parts_of_b_;
};

}  // namespace tessera::native
