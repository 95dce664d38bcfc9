#include "lpss/base/columns.h"

#include <gtest/gtest.h>

#include <random>

namespace tessera {
namespace {

template <typename Scalar>
void compare_with_eigen() {
  using Matrix = Eigen::Matrix<Scalar, 3, 3>;
  using Vector = Eigen::Matrix<Scalar, 3, 1>;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(-2, 2);
  const auto any = [&] { return static_cast<Scalar>(number(random)); };
  for (int n = 0; n < 1000; ++n) {
    const Matrix a = Matrix::NullaryExpr(any);
    const Matrix b = Matrix::NullaryExpr(any);
    const Vector v = Vector::NullaryExpr(any);
    const Columns<Scalar> columns(a);
    EXPECT_EQ(columns * v, Vector(a * v));
    EXPECT_EQ(columns * b, Matrix(a * b));
    EXPECT_EQ(columns.times_transposed(b), Matrix(a * b.transpose()));
    const Matrix product = a * b;
    const Matrix straightened =
        product * Matrix(Matrix::Identity() * Scalar(1.5) - product.transpose() * product * Scalar(0.5));
    EXPECT_EQ(Columns<Scalar>::straightened_product(a, b), straightened);
  }
}

TEST(Columns, GiveTheBitsOfEigen) {
  compare_with_eigen<float>();
  compare_with_eigen<double>();
}

}  // namespace
}  // namespace tessera
