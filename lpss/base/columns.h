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

  // a b, straightened: one step of Newton's method towards the nearest rotation, m (3 - m^T m) / 2.
  static Matrix straightened_product(const Matrix& a, const Matrix& b) {
    const Matrix m = a * b;
    return m * (Matrix::Identity() * 1.5 - m.transpose() * m * 0.5);
  }

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

  // Without a look at memory: what has just been written in parts is not there yet as a whole.
  static Matrix straightened_product(const Matrix& a, const Matrix& b) {
    const Columns by(a);
    const Columns m(by.times(b(0, 0), b(1, 0), b(2, 0)), by.times(b(0, 1), b(1, 1), b(2, 1)),
                    by.times(b(0, 2), b(1, 2), b(2, 2)));
    const Columns rows = m.transposed();
    const Wide x = Wide(1.5f, 0, 0, 0) - rows.times_wide(m.x_) * 0.5f;
    const Wide y = Wide(0, 1.5f, 0, 0) - rows.times_wide(m.y_) * 0.5f;
    const Wide z = Wide(0, 0, 1.5f, 0) - rows.times_wide(m.z_) * 0.5f;
    return matrix(m.times_wide(x), m.times_wide(y), m.times_wide(z));
  }

 private:
  EIGEN_STRONG_INLINE Columns(const Wide& x, const Wide& y, const Wide& z) : x_(x), y_(y), z_(z) {}

  EIGEN_STRONG_INLINE Columns transposed() const {
    return {Wide(x_[0], y_[0], z_[0], 0), Wide(x_[1], y_[1], z_[1], 0), Wide(x_[2], y_[2], z_[2], 0)};
  }
  EIGEN_STRONG_INLINE Wide times_wide(const Wide& v) const { return times(v[0], v[1], v[2]); }
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
