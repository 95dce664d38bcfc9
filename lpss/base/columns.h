// Products of 3 x 3 matrices. Eigen takes the numbers of such matrices one by one in single precision: here,
// columns are in registers of four numbers, of which the last one does not count. Sums are in the order of
// Eigen's, x + (y + z), so that either gives the same bits. In double precision Eigen has registers of two,
// in another order, which stays.
#pragma once

#include <Eigen/Core>

namespace tessera {

// A matrix by its columns, to be multiplied by others.
template <typename Scalar>
class Columns {
 public:
  using Vector = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix = Eigen::Matrix<Scalar, 3, 3>;

  explicit Columns(const Matrix& m) : m_(m) {}

  Vector operator*(const Vector& v) const { return m_ * v; }
  Matrix operator*(const Matrix& m) const { return m_ * m; }
  Matrix times_transposed(const Matrix& m) const { return m_ * m.transpose(); }

  // m^T m.
  static Matrix square_of(const Matrix& m) { return m.transpose() * m; }

 private:
  Matrix m_;
};

template <>
class Columns<float> {
 public:
  using Quad = Eigen::Array4f;
  using Vector = Eigen::Vector3f;
  using Matrix = Eigen::Matrix3f;

  explicit Columns(const Matrix& m)
      : x_(m(0, 0), m(1, 0), m(2, 0), 0),
        y_(m(0, 1), m(1, 1), m(2, 1), 0),
        z_(m(0, 2), m(1, 2), m(2, 2), 0) {}

  Vector operator*(const Vector& v) const { return three(times(v.x(), v.y(), v.z())); }
  Matrix operator*(const Matrix& m) const {
    return matrix(times(m(0, 0), m(1, 0), m(2, 0)), times(m(0, 1), m(1, 1), m(2, 1)),
                  times(m(0, 2), m(1, 2), m(2, 2)));
  }
  Matrix times_transposed(const Matrix& m) const {
    return matrix(times(m(0, 0), m(0, 1), m(0, 2)), times(m(1, 0), m(1, 1), m(1, 2)),
                  times(m(2, 0), m(2, 1), m(2, 2)));
  }

  static Matrix square_of(const Matrix& m) { return Columns(m.transpose()) * m; }

 private:
  EIGEN_STRONG_INLINE Quad times(float a, float b, float c) const { return x_ * a + (y_ * b + z_ * c); }
  static EIGEN_STRONG_INLINE Vector three(const Quad& q) { return {q[0], q[1], q[2]}; }
  static EIGEN_STRONG_INLINE Matrix matrix(const Quad& a, const Quad& b, const Quad& c) {
    Matrix m;
    m << three(a), three(b), three(c);
    return m;
  }

  Quad x_;
  Quad y_;
  Quad z_;
};

}  // namespace tessera
