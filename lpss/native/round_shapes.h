// Contact points of cylinders, ellipsoids and hulls of very many faces. Closed forms, GJK and EPA give the
// direction (lpss/collision/closest.h), and the faces or lines that look at each other the points.
#pragma once

#include "lpss/collision/collide.h"
#include "lpss/native/solid.h"

namespace tessera::native {

// As collide() of lpss/collision; both are convex. `before`: the normal of the last tick, or 0.
collision::Manifold<Scalar> collide_round(const Part& a, const Part& b,
                                          const collision::Placement<Scalar>& placement, Scalar margin,
                                          const Vector& before);
collision::Manifold<Scalar> collide_round(const Part& a, const collision::MeshTriangle<Scalar>& b,
                                          const collision::Placement<Scalar>& placement, Scalar margin);

// Any convex shape above the plane through b's centre, whose normal (in b's frame) points out of its half
// space.
collision::Manifold<Scalar> collide_plane(const Part& a, const Vector& normal,
                                          const collision::Placement<Scalar>& placement, Scalar margin);

// m, between two convex shapes; larger than `reach` if they are farther apart.
Scalar distance(const Part& a, const Frame& at_a, const Part& b, const Frame& at_b, Scalar reach);
Scalar distance(const Part& a, const Frame& at_a, const collision::MeshTriangle<Scalar>& b, const Frame& at_b,
                Scalar reach);

}  // namespace tessera::native
