// The closest points of two convex shapes by their cores or, where these overlap, the way along which they
// overlap least.
//
// Sources: Gilbert, Johnson, Keerthi, A Fast Procedure for Computing the Distance between Complex Objects,
// 1988; van den Bergen, Proximity Queries and Penetration Depth Computation on 3D Game Objects, 2001;
// Ericson, Real-Time Collision Detection, 2005, chapters 5 and 9.
#pragma once

#include <optional>

#include "lpss/collision/core.h"

namespace tessera::collision {

// Relative to the centre of a, world axes.
template <typename Scalar>
struct Closest {
  Vector3<Scalar> normal;  // unit length, from b to a
  Vector3<Scalar> on_a;    // m, on the surfaces, or where edges would be that are not rounded off
  Vector3<Scalar> on_b;
  Scalar gap;  // m, < 0 where the shapes overlap
};

// Nothing if the shapes are apart by more than `reach` (m, >= 0). `before`: the normal that was found a
// little earlier, if any, otherwise 0: from there, it is found sooner. Results depend on the arguments alone.
template <typename Scalar>
std::optional<Closest<Scalar>> closest(const Core<Scalar>& a, const Core<Scalar>& b,
                                       const Placement<Scalar>& placement, std::type_identity_t<Scalar> reach,
                                       const Vector3<Scalar>& before);

// The same without closed forms, which take round shapes that are almost level for level: exact to rounding
// for cores that round nothing off.
template <typename Scalar>
std::optional<Closest<Scalar>> search_closest(const Core<Scalar>& a, const Core<Scalar>& b,
                                              const Placement<Scalar>& placement,
                                              std::type_identity_t<Scalar> reach,
                                              const Vector3<Scalar>& before);

}  // namespace tessera::collision
