// What capsules do against polyhedra and against triangles alike.
#pragma once

#include "lpss/collision/hull.h"

namespace tessera::collision {

// The core of a capsule that is closer to another shape than this share of sizes meets it: rounding would
// decide on the direction between them.
inline constexpr double kCoreNoise = 1e-3;

// The two points of a capsule that lies along a face: its core goes from `low` to `low + along`, the normal
// of the manifold points from the face to it, and the points must be about as close as `gap` (m). Returns
// false if the capsule touches at one point only: `manifold` is then unchanged.
template <typename Scalar>
bool touch_face(const Face<Scalar>& face, const Vector3<Scalar>& low, const Vector3<Scalar>& along,
                Scalar radius, Scalar gap, Scalar margin, Manifold<Scalar>& manifold);

}  // namespace tessera::collision
