// A polytope inside of the difference of two convex shapes that overlap, which grows towards the face of the
// difference that is closest to the origin (van den Bergen, 2001).
#pragma once

#include <cstdint>
#include <optional>

#include "lpss/collision/core.h"
#include "lpss/collision/simplex.h"

namespace tessera::collision {

// The difference a - b of two cores.
template <typename Scalar>
class Difference {
 public:
  Difference(const PlacedCore<Scalar>& a, const PlacedCore<Scalar>& b) : a_(a), b_(b) {}

  DifferencePoint<Scalar> support(const Vector3<Scalar>& direction) const {
    const Vector3<Scalar> on_a = a_.support(direction);
    const Vector3<Scalar> on_b = b_.support(Vector3<Scalar>(-direction));
    return {on_a - on_b, on_a, on_b};
  }

 private:
  const PlacedCore<Scalar>& a_;
  const PlacedCore<Scalar>& b_;
};

// Where the surface of the difference is closest to the origin, which is inside: the shapes come apart by
// `depth` along `out`.
template <typename Scalar>
struct Penetration {
  Vector3<Scalar> out;  // unit length, from a to b
  Scalar depth;         // m
  Vector3<Scalar> on_a;
  Vector3<Scalar> on_b;
};

template <typename Scalar>
class Polytope {
 public:
  using Vector = Vector3<Scalar>;

  explicit Polytope(const Difference<Scalar>& difference) : difference_(difference) {}

  // From points of the difference whose hull holds the origin, or touches it.
  Penetration<Scalar> find(const Simplex<Scalar>& start);

 private:
  static constexpr int kPointsMax = 48;
  static constexpr int kFacesMax = 2 * kPointsMax;

  struct Face {
    std::uint8_t corner[3];  // counter-clockwise, seen from outside
    Vector normal;           // unit length, out
    Scalar distance;         // m, of its plane
  };

  bool widen_to_tetrahedron();
  bool add_face(int i, int j, int k);
  bool grow(int point);
  int closest_face() const;
  Penetration<Scalar> on_face(const Face& face, Scalar depth) const;
  Penetration<Scalar> flat() const;

  const Difference<Scalar>& difference_;
  DifferencePoint<Scalar> points_[kPointsMax];
  int point_count_ = 0;
  Face faces_[kFacesMax];
  int face_count_ = 0;
};

}  // namespace tessera::collision
