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
  using Wide = Vector;  // a vector in as many numbers as registers have

  explicit Columns(const Matrix& m) : m_(m) {}

  static Wide widened(const Vector& v) { return v; }
  static Vector narrowed(const Wide& v) { return v; }

  Wide times(const Vector& v) const { return m_ * v; }
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
  using Vector = Eigen::Vector3f;
  using Matrix = Eigen::Matrix3f;
  using Wide = Eigen::Vector4f;

  // The fourth numbers are those that follow in the matrix.
  explicit Columns(const Matrix& m)
      : x_(Wide::Map(m.data())), y_(Wide::Map(m.data() + 3)), z_(m(0, 2), m(1, 2), m(2, 2), 0) {}

  static Wide widened(const Vector& v) { return {v.x(), v.y(), v.z(), 0}; }
  static Vector narrowed(const Wide& v) { return {v.x(), v.y(), v.z()}; }

  Wide times(const Vector& v) const { return times(v.x(), v.y(), v.z()); }
  Vector operator*(const Vector& v) const { return narrowed(times(v)); }
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
  EIGEN_STRONG_INLINE Wide times(float a, float b, float c) const { return x_ * a + (y_ * b + z_ * c); }
  static EIGEN_STRONG_INLINE Matrix matrix(const Wide& a, const Wide& b, const Wide& c) {
    Matrix m;
    Wide::Map(m.data()) = a;
    Wide::Map(m.data() + 3) = b;
    m.col(2) = narrowed(c);
    return m;
  }

  Wide x_;
  Wide y_;
  Wide z_;
};

}  // namespace tessera
