// What a convex shape shows in a direction, of which contact points are made.
#pragma once

#include <optional>

#include "lpss/collision/collide.h"
#include "lpss/native/solid.h"

namespace tessera::native {

// A line along the side of a shape.
struct Line {
  Vector from;
  Vector to;
};

// A face, a line or, if neither, a point.
struct Feature {
  std::optional<collision::Face<Scalar>> face;
  std::optional<Line> line;
};

// Of a part, in its frame; `direction` likewise.
Feature feature_of(const Part& part, const Vector& direction);

Feature placed(Feature feature, const Matrix& rotation, const Vector& offset);

// The part of a line above a face, seen along its normal; and above a disc.
std::optional<Line> clipped(const Line& line, const collision::Face<Scalar>& face);
std::optional<Line> clipped(const Line& line, const Vector& centre, const Vector& normal, Scalar radius);

}  // namespace tessera::native
