#include "lpss/base/rotation.h"

#include <gmock/gmock.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>
#include <random>

namespace tessera {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

Vector3d some_direction(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return Vector3d(normal(random), normal(random), normal(random)).normalized();
}

TEST(Rotation, IsThatOfAxisAndAngle) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> angles(0, 20);
  for (int n = 0; n < 1000; ++n) {
    const Vector3d axis = some_direction(random);
    const double angle = angles(random);
    const Quaterniond expected(Eigen::AngleAxisd(angle, axis));
    EXPECT_LT((rotation_by(axis * angle).coeffs() - expected.coeffs()).norm(), 4e-15);
  }
}

// On both sides of the bound of the series.
TEST(Rotation, SmallOnesAreCorrectToTheLastBits) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> exponents(-20, -0.6);
  for (int n = 0; n < 10'000; ++n) {
    const Vector3d turn = some_direction(random) * std::pow(10, exponents(random));
    const Quaterniond rotation = rotation_by(turn);
    const Eigen::Matrix<long double, 3, 1> exact = turn.cast<long double>();
    const long double half = exact.norm() / 2;
    const long double scale = std::sin(half) / half / 2;
    for (int i = 0; i < 3; ++i) {
      const auto expected = exact[i] * scale;
      EXPECT_NEAR(rotation.vec()[i], double(expected), 4e-16 * std::abs(double(expected))) << half;
    }
    EXPECT_NEAR(rotation.w(), double(std::cos(half)), 1.2e-16) << half;
  }
}

TEST(Rotation, VectorComesBack) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> exponents(-300, 0.49);
  for (int n = 0; n < 1000; ++n) {
    const Vector3d turn = some_direction(random) * std::pow(10, exponents(random));
    const Quaterniond rotation = rotation_by(turn);
    const double tolerance = 1e-15 * turn.norm() + 1e-300;
    EXPECT_LT((rotation_vector(rotation) - turn).cwiseAbs().maxCoeff(), tolerance) << turn.transpose();
    // The same rotation with the other sign.
    const Quaterniond opposite(Eigen::Vector4d(-rotation.coeffs()));
    EXPECT_EQ(rotation_vector(opposite), rotation_vector(rotation));
    EXPECT_NEAR(rotation_angle(rotation), turn.norm(), 1e-15 * turn.norm() + 1e-160);
  }
}

TEST(Rotation, OfNothingIsTheIdentity) {
  EXPECT_EQ(rotation_by(Vector3d::Zero()).coeffs(), Quaterniond::Identity().coeffs());
  EXPECT_EQ(rotation_vector(Quaterniond::Identity()), Vector3d::Zero());
  EXPECT_EQ(rotation_angle(Quaterniond::Identity()), 0);
}

TEST(Rotation, HalfATurn) {
  const Quaterniond half(0, 0, 1, 0);
  EXPECT_EQ(rotation_vector(half), Vector3d(0, std::numbers::pi, 0));
  EXPECT_EQ(rotation_angle(half), std::numbers::pi);
}

TEST(Rotation, TurnsAxesInBothPrecisions) {
  const Vector3d turn(0, 0, std::numbers::pi / 2);
  const Eigen::Matrix3d axes = turned<double>(Eigen::Matrix3d::Identity(), turn);
  EXPECT_LT((axes.col(0) - Vector3d::UnitY()).norm(), 1e-15);
  const Eigen::Matrix3f single = turned<float>(Eigen::Matrix3f::Identity(), turn);
  EXPECT_EQ(single, axes.cast<float>());
}

// Of a thin bar, as an engine has it that computes in single precision.
TEST(Rotation, ATensorAlongRoundedAxesHasNoNegativeValues) {
  std::mt19937_64 random(11);
  const Eigen::Vector3f principal(1e6F, 0.01F, 0.01F);
  for (int n = 0; n < 1000; ++n) {
    const Eigen::Matrix3f axes = rotation_by(3 * some_direction(random)).toRotationMatrix().cast<float>();
    const Eigen::Matrix3d tensor = tensor_along(axes, principal);
    EXPECT_LT((tensor - tensor.transpose()).norm(), 1e-9);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(tensor).eigenvalues()[0], -1e-9) << n;
  }
}

}  // namespace
}  // namespace tessera
