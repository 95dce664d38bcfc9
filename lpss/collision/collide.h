// Contacts of two convex shapes: where they touch, overlap, or are apart by at most a margin.
//
// Everything is relative to the centre of a, in world axes. `margin` >= 0 (m): points with a larger gap are
// dropped. Where shapes overlap, the normal is the direction of least penetration, with a small preference of
// faces over edges and of a's faces over b's, so that resting shapes do not change their features. Where
// faces are opposite each other, gaps are along the normal of a face; otherwise they are true distances.
//
// Results depend on the arguments alone. No function allocates memory; all may be called from any thread.
//
// Sources: Gregorius, The Separating Axis Test between Convex Polyhedra, GDC 2013; Ericson, Real-Time
// Collision Detection, 2005, chapter 5.
#pragma once

#include <type_traits>

#include "lpss/collision/manifold.h"
#include "lpss/collision/shapes.h"

namespace tessera::collision {

template <typename Scalar>
using Margin = std::type_identity_t<Scalar>;

// A ball touches at one point, of feature 0: it rolls over faces and edges alike.
template <typename Scalar>
Manifold<Scalar> collide(const Ball<Scalar>& a, const Ball<Scalar>& b, const Placement<Scalar>& placement,
                         Margin<Scalar> margin);
template <typename Scalar>
Manifold<Scalar> collide(const Ball<Scalar>& a, const Capsule<Scalar>& b, const Placement<Scalar>& placement,
                         Margin<Scalar> margin);
template <typename Scalar>
Manifold<Scalar> collide(const Ball<Scalar>& a, const Box<Scalar>& b, const Placement<Scalar>& placement,
                         Margin<Scalar> margin);
template <typename Scalar>
Manifold<Scalar> collide(const Ball<Scalar>& a, const Polyhedron<Scalar>& b,
                         const Placement<Scalar>& placement, Margin<Scalar> margin);

// A capsule that lies along a face or another capsule touches at two points. The feature is the end of the
// first capsule that is nearer: 0 at -z, 1 at +z.
template <typename Scalar>
Manifold<Scalar> collide(const Capsule<Scalar>& a, const Capsule<Scalar>& b,
                         const Placement<Scalar>& placement, Margin<Scalar> margin);
template <typename Scalar>
Manifold<Scalar> collide(const Capsule<Scalar>& a, const Box<Scalar>& b, const Placement<Scalar>& placement,
                         Margin<Scalar> margin);
template <typename Scalar>
Manifold<Scalar> collide(const Capsule<Scalar>& a, const Polyhedron<Scalar>& b,
                         const Placement<Scalar>& placement, Margin<Scalar> margin);

template <typename Scalar>
Manifold<Scalar> collide(const Box<Scalar>& a, const Box<Scalar>& b, const Placement<Scalar>& placement,
                         Margin<Scalar> margin);
template <typename Scalar>
Manifold<Scalar> collide(const Box<Scalar>& a, const Polyhedron<Scalar>& b,
                         const Placement<Scalar>& placement, Margin<Scalar> margin);
template <typename Scalar>
Manifold<Scalar> collide(const Polyhedron<Scalar>& a, const Polyhedron<Scalar>& b,
                         const Placement<Scalar>& placement, Margin<Scalar> margin);

// The same pairs in the other order.
template <typename Shape>
inline constexpr int kRank = -1;
template <typename Scalar>
inline constexpr int kRank<Ball<Scalar>> = 0;
template <typename Scalar>
inline constexpr int kRank<Capsule<Scalar>> = 1;
template <typename Scalar>
inline constexpr int kRank<Box<Scalar>> = 2;
template <typename Scalar>
inline constexpr int kRank<Polyhedron<Scalar>> = 3;

template <typename Scalar, template <typename> typename A, template <typename> typename B>
requires(kRank<B<Scalar>> >= 0 && kRank<A<Scalar>> > kRank<B<Scalar>>) Manifold<Scalar> collide(
    const A<Scalar>& a, const B<Scalar>& b, const Placement<Scalar>& placement, Margin<Scalar> margin) {
  const Placement<Scalar> reverse = placement.swapped();
  return swapped(collide(b, a, reverse, margin), reverse.offset);
}

// Triangles of meshes.
//
// A contact whose normal leans over an edge further than the neighbour allows (MeshTriangle) belongs to the
// neighbour. Balls do not touch the triangle then: the neighbour is nearer. Other shapes touch what is
// directly above the triangle, along its normal, but no deeper than found; a polyhedron that overlaps the
// edge of a ridge is pushed along the last allowed normal instead. So no contact of a shape that overlaps the
// surface is lost, and none is deeper than the least penetration of the lone triangle. What is only behind
// the triangle, with the centre of the shape in front of it, does not touch it.
//
// A shape is kept on a side of the surface (KeptOn). With its centre beyond a ridge it is on the front,
// though behind the plane of the triangle.
//
// Precision is that of the vertices in the frame of b: near the origin of that frame it is best.
template <typename Scalar>
Manifold<Scalar> collide(const Ball<Scalar>& a, const MeshTriangle<Scalar>& b,
                         const Placement<Scalar>& placement, Margin<Scalar> margin);
template <typename Scalar>
Manifold<Scalar> collide(const Capsule<Scalar>& a, const MeshTriangle<Scalar>& b,
                         const Placement<Scalar>& placement, Margin<Scalar> margin);
template <typename Scalar>
Manifold<Scalar> collide(const Box<Scalar>& a, const MeshTriangle<Scalar>& b,
                         const Placement<Scalar>& placement, Margin<Scalar> margin);
template <typename Scalar>
Manifold<Scalar> collide(const Polyhedron<Scalar>& a, const MeshTriangle<Scalar>& b,
                         const Placement<Scalar>& placement, Margin<Scalar> margin);

// Whether a shape with its centre at `p` (m, in the frame of the triangle) is kept behind the triangle.
template <typename Scalar>
bool is_kept_behind(const MeshTriangle<Scalar>& triangle, const Vector3<Scalar>& p);

}  // namespace tessera::collision
