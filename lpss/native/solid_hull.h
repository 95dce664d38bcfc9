// The forms of a convex hull that contacts and rays need.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "lpss/collision/convex_hull.h"
#include "lpss/model/shape.h"
#include "lpss/native/math.h"

namespace tessera::native {

// A hull of up to so many corners, and so few a face as a Polyhedron may have, is taken as it is. Contacts of
// a larger one are those of a simplified one inside of it, of at most collision::kHullVerticesMax corners: no
// point is farther outside than 1e-3 of the smallest extent, or what so many corners allow: 2e-3 for a ball,
// and of flat discs, whose faces may have collision::kFaceVerticesMax corners, 1e-3 of the diameter. Rays
// meet the hull as it is, and mass and inertia are not derived from it here.
inline constexpr std::size_t kHullVerticesUsual = 256;

class SolidHull {
 public:
  explicit SolidHull(const ConvexHull& hull);

  // The points to take in the place of the hull's own; none if that has few.
  std::optional<ConvexHull> simplified() const;

  // In a frame in which the hull has this pose; none of a hull so thin that its faces are mixed up.
  std::optional<collision::Polyhedron<Scalar>> polyhedron(const Pose& pose) const;

  // What the points given have, likewise.
  std::vector<collision::HalfSpace<double>> planes(const Pose& pose) const;

 private:
  collision::HullTriangles whole_;
  std::optional<collision::HullTriangles> simplified_;
};

}  // namespace tessera::native
