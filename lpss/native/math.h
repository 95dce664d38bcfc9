// Numbers of the engine, in the precision of its module.
#pragma once

#include <LinearMath/btTransform.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <limits>

#include "lpss/grid/world_position.h"

namespace tessera::native {

using Scalar = btScalar;
using Vector = Eigen::Matrix<Scalar, 3, 1>;
using Matrix = Eigen::Matrix<Scalar, 3, 3>;

// Maps a frame to another: x -> rotation * x + position.
struct Frame {
  Matrix rotation = Matrix::Identity();
  Vector position = Vector::Zero();

  Vector operator*(const Vector& point) const { return rotation * point + position; }
  Vector inverse(const Vector& point) const { return rotation.transpose() * (point - position); }
  bool is_somewhere() const { return position.allFinite() && rotation.allFinite(); }
};

inline Frame operator*(const Frame& outer, const Frame& inner) {
  return {outer.rotation * inner.rotation, outer * inner.position};
}

// An axis-aligned bounding box.
struct Bounds {
  Vector low = Vector::Zero();
  Vector high = Vector::Zero();

  // Overlap nothing, and are inside any.
  static Bounds nothing() {
    constexpr Scalar kFar = std::numeric_limits<Scalar>::max();
    return {Vector::Constant(kFar), Vector::Constant(-kFar)};
  }

  bool overlaps(const Bounds& other) const {
    return low.x() <= other.high.x() && other.low.x() <= high.x() && low.y() <= other.high.y() &&
           other.low.y() <= high.y() && low.z() <= other.high.z() && other.low.z() <= high.z();
  }
  bool contains(const Bounds& other) const {
    return low.x() <= other.low.x() && other.high.x() <= high.x() && low.y() <= other.low.y() &&
           other.high.y() <= high.y() && low.z() <= other.low.z() && other.high.z() <= high.z();
  }
  Bounds grown(Scalar margin) const {
    return {low - Vector::Constant(margin), high + Vector::Constant(margin)};
  }
  Bounds moved(const Vector& way) const { return {low + way, high + way}; }

  // Of these, posed by a frame.
  Bounds posed(const Frame& at) const {
    const Vector centre = at * ((low + high) / 2);
    const Vector half = at.rotation.cwiseAbs() * ((high - low) / 2);
    return {centre - half, centre + half};
  }
  void extend(const Bounds& other) {
    low = low.cwiseMin(other.low);
    high = high.cwiseMax(other.high);
  }
};

// Doubles from the engine convert back without rounding, whatever Scalar is.
inline Vector vector(const std::array<double, 3>& v) { return {Scalar(v[0]), Scalar(v[1]), Scalar(v[2])}; }
inline std::array<double, 3> array(const Vector& v) { return {double(v.x()), double(v.y()), double(v.z())}; }

inline Matrix matrix(const std::array<double, 9>& rows) {
  Matrix m;
  for (int n = 0; n < 9; ++n) m(n / 3, n % 3) = Scalar(rows[static_cast<std::size_t>(n)]);
  return m;
}
inline std::array<double, 9> array(const Matrix& m) {
  std::array<double, 9> rows;
  for (int n = 0; n < 9; ++n) rows[static_cast<std::size_t>(n)] = double(m(n / 3, n % 3));
  return rows;
}

// Rotations are computed in double precision, so that only the result is rounded.
inline Frame frame(const Pose& pose) {
  return {pose.orientation.normalized().toRotationMatrix().cast<Scalar>(), pose.position.cast<Scalar>()};
}

// For Bullet's queries.
inline btVector3 bt(const Vector& v) { return {v.x(), v.y(), v.z()}; }
inline Vector vector(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
inline btTransform bt(const Frame& f) {
  const Matrix& m = f.rotation;
  return btTransform(
      btMatrix3x3(m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2)),
      bt(f.position));
}

}  // namespace tessera::native
