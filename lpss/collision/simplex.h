// Up to four points of the difference of two convex shapes, and the point of their hull that is closest to
// the origin.
#pragma once

#include <Eigen/Geometry>
#include <array>

#include "lpss/collision/shapes.h"

namespace tessera::collision {

// A point of the difference a - b.
template <typename Scalar>
struct DifferencePoint {
  Vector3<Scalar> at;
  Vector3<Scalar> on_a;
  Vector3<Scalar> on_b;
};

// The closest point of the hull of some points of a simplex, by their places in it.
template <typename Scalar>
struct ClosestOfSimplex {
  Vector3<Scalar> at = Vector3<Scalar>::Zero();
  int count = 0;
  std::array<int, 3> place{};  // ascending
  std::array<Scalar, 3> weight{};
};

template <typename Scalar>
struct Simplex {
  using Vector = Vector3<Scalar>;

  int count = 0;
  DifferencePoint<Scalar> point[4];
  Scalar weight[4];  // of the closest point, once those that it needs are kept

  void add(const DifferencePoint<Scalar>& added) { point[count++] = added; }

  // Of parts that hold the point that was added last, as is right where it was found beyond the closest point
  // of the others. Of no points if the origin is inside of four, which is looked for if it may be.
  ClosestOfSimplex<Scalar> closest(bool may_hold_origin) const;
  void keep(const ClosestOfSimplex<Scalar>& closest);

  Vector on_a() const { return mean(&DifferencePoint<Scalar>::on_a); }
  Vector on_b() const { return mean(&DifferencePoint<Scalar>::on_b); }

 private:
  Vector mean(Vector DifferencePoint<Scalar>::*place) const {
    Vector sum = weight[0] * (point[0].*place);
    for (int n = 1; n < count; ++n) sum += weight[n] * (point[n].*place);
    return sum;
  }
};

}  // namespace tessera::collision
